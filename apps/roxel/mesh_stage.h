#pragma once
/// From a run's depth maps to its mesh: what `roxel mesh` and the mesh stage of `roxel reconstruct` do.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "common.h"
#include "roxel/io/volume_file.h"
#include "roxel/surface/surface.h"

namespace roxel::cli {

struct MeshOptions {
  std::optional<double> voxel_size;
  double band = 3;
  double least_sigma = 0.5;
  int min_views = 2;
  double hole_size = 8;
  double smallest_part = 16;
};

const OptionTable<MeshOptions>& mesh_option_table();

struct MeshInput {
  const Dataset& dataset;
  const PhotographLoader& load;
  const VolumeFile& volume;
  Eigen::AlignedBox3d box;
  std::filesystem::path depth_run;  ///< depth/NAME.exr are below it
};

/// Writes mesh.ply below `results`.
void make_mesh(const MeshInput& input, const MeshOptions& options, const std::filesystem::path& results,
               Session& session);

}  // namespace roxel::cli

#pragma once
/// From a run's depth maps to its mesh: what `roxel mesh` and the mesh stage of `roxel reconstruct` do.

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common.h"
#include "roxel/io/volume_file.h"
#include "roxel/report/html_report.h"

namespace roxel::cli {

enum class MeshColors { kCanonical, kImage };
enum class MeshTexture { kPng, kJpeg, kNone };

struct MeshOptions {
  std::optional<double> voxel_size;
  double band = 5;
  int min_views = 2;
  double hole_size = 12;
  double smallest_part = 16;
  double smooth = 0.3;
  std::optional<std::int64_t> faces;
  double error = 0.1;
  MeshColors colors = MeshColors::kCanonical;
  MeshTexture texture = MeshTexture::kPng;
  int texture_size = 8192;
  double seam_cost = 0.6;
  bool level_seams = true;
  double transient = 0.12;
  bool pictures = true;
};

const OptionTable<MeshOptions>& mesh_option_table();

/// A run as far as its mesh needs it.
struct MeshInput {
  const Dataset& dataset;
  const PhotographLoader& load;
  const Volume& volume;
  VolumeInfo info;
  Eigen::AlignedBox3d box;
  std::filesystem::path depth_run;  ///< depth/NAME.exr are below it
  std::optional<double> memory;     ///< GiB that the process may hold; none: what the machine has at hand
  double progress_begin = 0;        ///< fractions of the whole command
  double progress_end = 1;
};

struct MeshResult {
  nlohmann::ordered_json figures;  ///< "mesh" of summary.json
  std::string text;                ///< for people, a few lines
  std::vector<std::string> warnings;
  ReportMesh pictures;
};

inline constexpr int kTurns = 24;            ///< pictures of a turntable, side by side
inline constexpr int kMeshSheetWidth = 980;  ///< of mesh_views.png, pixels

/// The files of a mesh in the folder of a run, whether they are there or not.
std::vector<std::string> mesh_files();

/// A lattice much finer than the volume costs memory and shows nothing more: taken for a mistake. Throws
/// InvalidInput.
void check_mesh_voxel_size(const MeshOptions& options, double volume_voxel_size);

/// Writes them below `results` (see mesh_files). Throws InvalidInput where there is no depth, no surface, or
/// the target cannot be reached; IoError; Cancelled.
MeshResult make_mesh(const MeshInput& input, const MeshOptions& options, const std::filesystem::path& results,
                     RunContext& context);

}  // namespace roxel::cli

#pragma once
/// A run's depth and normal maps as a COLMAP dense workspace (roxel/io/colmap_dense.h).

#include <filesystem>

#include "roxel/base/run_context.h"
#include "roxel/dataset/dataset.h"

namespace roxel::cli {

/// Writes undistorted images, cameras, and the best depth that RUN/depth has of every view, with normals
/// where it has them (fitted planes where not). `results`: where files are written; `folder`: where they will
/// lie in the end. Throws InvalidInput where the run has no depth.
void write_dense_workspace(Dataset dataset, const PhotographLoader& load, const std::filesystem::path& run,
                           const std::filesystem::path& results, double white, double voxel_size,
                           RunContext& context);

}  // namespace roxel::cli

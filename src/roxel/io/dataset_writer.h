#pragma once
/// Writes calibrated cameras so that read_dataset gets back what was written. Images and masks are not
/// touched: they must already lie under the folder (or transforms.json then names them by their way there).

#include <filesystem>

#include "roxel/dataset/dataset.h"

namespace roxel {

/// Writes `folder`/transforms.json: per view the lens, pose (OpenGL camera-to-world), node, time, place, near
/// and far; scene_bounds. Paths are relative to `folder`. Numbers keep every bit, times the microsecond.
void write_transforms(const Dataset& dataset, const std::filesystem::path& folder);

/// Writes `folder`/sparse/0/{cameras,images,points3D}.txt; equal lenses share a camera. Points have no
/// tracks. COLMAP's names are paths below `folder`/images: throws InvalidInput for an image elsewhere, and
/// for a camera with skew, which COLMAP does not have. Nodes, times, near and far are not part of the format.
void write_colmap_text(const Dataset& dataset, const std::filesystem::path& folder);

}  // namespace roxel

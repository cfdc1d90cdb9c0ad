#pragma once
/// A COLMAP dense workspace: depth and normal maps beside undistorted images and a sparse model, as COLMAP's
/// stereo_fusion and its meshers read them [COLMAP].
///
///   FOLDER/images/NAME.png                  written by whoever calls
///   FOLDER/sparse/{cameras,images,points3D}.txt
///   FOLDER/stereo/depth_maps/NAME.png.geometric.bin
///   FOLDER/stereo/normal_maps/NAME.png.geometric.bin
///   FOLDER/stereo/patch-match.cfg, fusion.cfg

#include <filesystem>
#include <utility>
#include <vector>

#include "roxel/dataset/dataset.h"
#include "roxel/image/image.h"

namespace roxel {

/// "WIDTH&HEIGHT&CHANNELS&", then floats: channel by channel, row by row, little-endian. Atomic; throws
/// IoError.
void write_colmap_map(const std::filesystem::path& path, const Image& map);
/// Throws InvalidInput, naming the file, for what is no such file.
Image read_colmap_map(const std::filesystem::path& path);

/// A point and the pixels that show it.
struct TrackedPoint {
  Eigen::Vector3d position;
  std::vector<std::pair<int, Eigen::Vector2d>> sightings;  ///< index of the view, pixel position
};

/// Writes FOLDER/sparse and the two .cfg files. COLMAP chooses which views are fused together by the points
/// that they share. Images must lie under FOLDER/images, and lenses be pinholes without skew: throws
/// InvalidInput otherwise.
void write_colmap_workspace(const Dataset& dataset, const std::vector<TrackedPoint>& points,
                            const std::filesystem::path& folder);

/// FOLDER/stereo/KIND_maps/NAME.geometric.bin of a view; kind is "depth" or "normal".
std::filesystem::path colmap_map_path(const std::filesystem::path& folder, const char* kind,
                                      const View& view);

}  // namespace roxel

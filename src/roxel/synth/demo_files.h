#pragma once
/// The text files of a synthetic data set: cameras and sparse points.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "roxel/camera/camera.h"

namespace roxel {

/// A surface point and the images that see it.
struct SparsePoint {
  Eigen::Vector3d position;
  std::array<std::uint8_t, 3> srgb;
  struct Observation {
    int image_idx;
    Eigen::Vector2d pixel;
  };
  std::vector<Observation> observations;
};

/// Cameras that share one set of intrinsics without skew. Image i is images/iii.png, its mask mask/iii.png,
/// its depth depth/iii.exr.
struct SyntheticCameras {
  std::vector<PinholeCamera> cameras;
  Eigen::AlignedBox3d bounds;
};

/// The image's name without folder and suffix: "000", "001", ...
std::string synthetic_name(int image_idx);

/// FOLDER/transforms.json: OpenGL camera-to-world matrices (x right, y up, looking along -z).
void write_synthetic_transforms(const std::filesystem::path& folder, const SyntheticCameras& set);

/// FOLDER/sparse/0/cameras.txt, images.txt, points3D.txt.
void write_synthetic_colmap(const std::filesystem::path& folder, const SyntheticCameras& set,
                            const std::vector<SparsePoint>& points);

}  // namespace roxel

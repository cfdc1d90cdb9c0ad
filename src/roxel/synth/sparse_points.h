#pragma once
/// Points on a world's surface with the images that see them, as structure from motion would find them.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "roxel/camera/camera.h"
#include "roxel/image/image.h"

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

/// What is asked of a world.
struct SurfaceQueries {
  /// Whether nothing stands between a surface point and a camera's centre.
  std::function<bool(const Eigen::Vector3d& point, const Eigen::Vector3d& centre)> visible;
  /// Linear RGB of a surface point that pixel (x, y) of the image shows.
  std::function<Eigen::Vector3f(const Eigen::Vector3d& point, int x, int y)> color;
};

/// At most `count` points at random pixels of one image that show a surface, each seen by two cameras or
/// more. A pure function of its arguments.
std::vector<SparsePoint> points_of_image(int image_idx, int count, const Image& depth,
                                         const std::vector<PinholeCamera>& cameras,
                                         const SurfaceQueries& world, std::uint32_t seed);

/// The share of `total` points that is asked of one of `images` images; the rest of the division goes to the
/// first ones.
int points_asked_of(int image_idx, int images, int total);

}  // namespace roxel

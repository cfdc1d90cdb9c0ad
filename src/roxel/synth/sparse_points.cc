#include "roxel/synth/sparse_points.h"

#include <algorithm>
#include <cmath>

#include "roxel/color/color_space.h"
#include "roxel/synth/noise.h"

namespace roxel {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

std::array<std::uint8_t, 3> display_code(const Vector3f& rgb) {
  std::array<std::uint8_t, 3> code;
  for (int c = 0; c < 3; ++c)
    code[c] = static_cast<std::uint8_t>(std::lround(255 * srgb_encode(std::clamp(rgb[c], 0.0f, 1.0f))));
  return code;
}

std::vector<SparsePoint::Observation> observations(const Vector3d& point, const SurfaceQueries& world,
                                                   const std::vector<PinholeCamera>& cameras) {
  std::vector<SparsePoint::Observation> seen;
  for (int i = 0; i < static_cast<int>(cameras.size()); ++i) {
    const Intrinsics& k = cameras[i].intrinsics;
    const Vector3d pixel = cameras[i].project(point);
    const bool inside =
        pixel.z() > 0 && pixel.x() > 0 && pixel.y() > 0 && pixel.x() < k.width && pixel.y() < k.height;
    if (inside && world.visible(point, cameras[i].pose.centre)) seen.push_back({i, pixel.head<2>()});
  }
  return seen;
}

}  // namespace

std::vector<SparsePoint> points_of_image(int image_idx, int count, const Image& depth,
                                         const std::vector<PinholeCamera>& cameras,
                                         const SurfaceQueries& world, std::uint32_t seed) {
  std::vector<SparsePoint> points;
  for (int attempt = 0; attempt < 20 * count && static_cast<int>(points.size()) < count; ++attempt) {
    const int x = static_cast<int>(lattice_hash(attempt, image_idx, 0, seed) % depth.width());
    const int y = static_cast<int>(lattice_hash(attempt, image_idx, 1, seed) % depth.height());
    const float z = *depth.pixel(x, y);
    if (!(z > 0)) continue;
    const Ray ray = cameras[image_idx].ray(x + 0.5, y + 0.5);
    const Vector3d position = ray.origin + z * ray.direction;
    auto seen = observations(position, world, cameras);
    if (seen.size() < 2) continue;
    points.push_back({position, display_code(world.color(position, x, y)), std::move(seen)});
  }
  return points;
}

int points_asked_of(int image_idx, int images, int total) {
  return total / images + (image_idx < total % images);
}

}  // namespace roxel

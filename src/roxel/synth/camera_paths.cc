#include "roxel/synth/camera_paths.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace roxel {

using Eigen::Vector3d;

Pose looking_at(const Vector3d& centre, const Vector3d& target) {
  const Vector3d forward = (target - centre).normalized();
  const bool steep = std::abs(forward.z()) > 0.999;
  const Vector3d up = steep ? Vector3d(0, forward.z() < 0 ? 1 : -1, 0) : Vector3d::UnitZ();
  const Vector3d right = forward.cross(up).normalized();
  Pose pose;
  pose.centre = centre;
  pose.rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  return pose;
}

Intrinsics simple_intrinsics(int width, int height, double focal_share) {
  const double focal = focal_share * std::min(width, height);
  return {width, height, focal, focal, width / 2.0, height / 2.0, 0};
}

Vector3d around(const Vector3d& target, double distance, double azimuth_deg, double elevation_deg) {
  const double a = azimuth_deg * std::numbers::pi / 180, e = elevation_deg * std::numbers::pi / 180;
  return target + distance * Vector3d(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
}

// Rings of 8, 7 and 4 images and one of the zenith: neighbours overlap by about a fifth.
std::vector<Vector3d> hemisphere_directions() {
  struct Ring {
    int count;
    double elevation_deg;
  };
  std::vector<Vector3d> directions;
  for (const Ring& ring : {Ring{8, 10}, Ring{7, 42}, Ring{4, 70}, Ring{1, 90}})
    for (int i = 0; i < ring.count; ++i)
      directions.push_back(around(Vector3d::Zero(), 1, 360.0 * i / ring.count, ring.elevation_deg));
  return directions;
}

}  // namespace roxel

#include "roxel/synth/pose_noise.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "roxel/synth/noise.h"

namespace roxel {
namespace {

using Eigen::Vector3d;

Vector3d normal_vector(int item, int what, std::uint32_t seed) {
  Vector3d v;
  for (int i = 0; i < 3; ++i) {
    const double radius =
        std::sqrt(-2 * std::log(1 - static_cast<double>(lattice_random(item, what, 2 * i, seed))));
    v[i] = radius * std::cos(2 * std::numbers::pi * lattice_random(item, what, 2 * i + 1, seed));
  }
  return v;
}

Eigen::Matrix3d turned_by(const Vector3d& angles_rad) {
  const double angle = angles_rad.norm();
  if (!(angle > 0)) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, angles_rad / angle).toRotationMatrix();
}

}  // namespace

std::vector<PinholeCamera> with_pose_noise(std::vector<PinholeCamera> cameras, const PoseNoise& noise,
                                           std::uint32_t seed) {
  if (!noise.any()) return cameras;
  std::vector<Vector3d> centres;  // of the first camera of each node
  for (PinholeCamera& camera : cameras) {
    int item = 0;
    while (item < static_cast<int>(centres.size()) && centres[item] != camera.pose.centre) ++item;
    if (item == static_cast<int>(centres.size())) centres.push_back(camera.pose.centre);
    const Vector3d angles =
        noise.rotation_deg * std::numbers::pi / 180 * normal_vector(item, 0, seed ^ 0x905eu);
    camera.pose.rotation = camera.pose.rotation * turned_by(angles);
    camera.pose.centre += noise.translation * normal_vector(item, 1, seed ^ 0x905eu);
  }
  return cameras;
}

}  // namespace roxel

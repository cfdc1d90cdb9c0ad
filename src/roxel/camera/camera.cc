#include "roxel/camera/camera.h"

#include <Eigen/Geometry>

namespace roxel {

Eigen::Matrix3d Intrinsics::matrix() const {
  Eigen::Matrix3d k;
  k << fx, skew, cx, 0, fy, cy, 0, 0, 1;
  return k;
}

Eigen::Vector2d pixel_from_normalised(const Intrinsics& k, const Eigen::Vector2d& x) {
  return {k.fx * x.x() + k.skew * x.y() + k.cx, k.fy * x.y() + k.cy};
}

Eigen::Vector2d normalised_from_pixel(const Intrinsics& k, const Eigen::Vector2d& pixel) {
  const double y = (pixel.y() - k.cy) / k.fy;
  return {(pixel.x() - k.cx - k.skew * y) / k.fx, y};
}

Eigen::Vector3d PinholeCamera::camera_from_world(const Eigen::Vector3d& x_in_world) const {
  return pose.rotation * (x_in_world - pose.centre);
}

Eigen::Vector3d PinholeCamera::world_from_camera(const Eigen::Vector3d& x_in_camera) const {
  return pose.rotation.transpose() * x_in_camera + pose.centre;
}

Eigen::Vector3d PinholeCamera::project(const Eigen::Vector3d& x_in_world) const {
  const Eigen::Vector3d x = camera_from_world(x_in_world);
  const Eigen::Vector2d pixel = pixel_from_normalised(intrinsics, x.head<2>() / x.z());
  return {pixel.x(), pixel.y(), x.z()};
}

Ray PinholeCamera::ray(double u, double v) const {
  const Eigen::Vector2d x = normalised_from_pixel(intrinsics, {u, v});
  return {pose.centre, pose.rotation.transpose() * x.homogeneous()};
}

}  // namespace roxel

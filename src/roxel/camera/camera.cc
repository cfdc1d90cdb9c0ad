#include "roxel/camera/camera.h"

namespace roxel {

Eigen::Matrix3d Intrinsics::matrix() const {
  Eigen::Matrix3d k;
  k << fx, skew, cx, 0, fy, cy, 0, 0, 1;
  return k;
}

Eigen::Vector3d PinholeCamera::camera_from_world(const Eigen::Vector3d& x_in_world) const {
  return pose.rotation * (x_in_world - pose.centre);
}

Eigen::Vector3d PinholeCamera::world_from_camera(const Eigen::Vector3d& x_in_camera) const {
  return pose.rotation.transpose() * x_in_camera + pose.centre;
}

Eigen::Vector3d PinholeCamera::project(const Eigen::Vector3d& x_in_world) const {
  const Eigen::Vector3d x = camera_from_world(x_in_world);
  const double u = (intrinsics.fx * x.x() + intrinsics.skew * x.y()) / x.z() + intrinsics.cx;
  const double v = intrinsics.fy * x.y() / x.z() + intrinsics.cy;
  return {u, v, x.z()};
}

Ray PinholeCamera::ray(double u, double v) const {
  const double y = (v - intrinsics.cy) / intrinsics.fy;
  const double x = (u - intrinsics.cx - intrinsics.skew * y) / intrinsics.fx;
  return {pose.centre, pose.rotation.transpose() * Eigen::Vector3d(x, y, 1)};
}

}  // namespace roxel

#pragma once
/// Calibrated pinhole cameras. Conventions (docs/cameras.md): x_in_camera = R (x_in_world - centre); the
/// camera looks along +z, x to the right, y down; the centre of the top-left pixel is (0.5, 0.5).

#include <Eigen/Core>

namespace roxel {

/// K = [fx skew cx; 0 fy cy; 0 0 1] in pixels, for an image of width x height pixels.
struct Intrinsics {
  int width = 0;
  int height = 0;
  double fx = 0;
  double fy = 0;
  double cx = 0;
  double cy = 0;
  double skew = 0;

  Eigen::Matrix3d matrix() const;
  bool operator==(const Intrinsics&) const = default;
};

/// Pixel position K (x, y, 1) of the normalised position (x/z, y/z), and its inverse.
Eigen::Vector2d pixel_from_normalised(const Intrinsics& intrinsics, const Eigen::Vector2d& x_normalised);
Eigen::Vector2d normalised_from_pixel(const Intrinsics& intrinsics, const Eigen::Vector2d& pixel);

/// x_in_camera = rotation * (x_in_world - centre); rotation is camera_from_world, orthonormal, det +1.
struct Pose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
};

/// x(depth) = origin + depth * direction: the direction has unit z in the camera, so the parameter is the
/// distance along the optical axis, in world units.
struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
};

struct PinholeCamera {
  Intrinsics intrinsics;
  Pose pose;

  Eigen::Vector3d camera_from_world(const Eigen::Vector3d& x_in_world) const;
  Eigen::Vector3d world_from_camera(const Eigen::Vector3d& x_in_camera) const;
  /// (u, v, depth); u and v in pixels mean something only where depth > 0.
  Eigen::Vector3d project(const Eigen::Vector3d& x_in_world) const;
  /// The ray through pixel position (u, v), e.g. (0.5, 0.5) for the top-left pixel's centre.
  Ray ray(double u, double v) const;
};

}  // namespace roxel

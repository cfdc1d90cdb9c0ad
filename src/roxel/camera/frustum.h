#pragma once
/// What a camera can see: the part of the viewing pyramid through its image's edges between two depths.
/// Depths are along the optical axis, in world units; 0 <= near < far, far may be infinite where it says so.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <limits>

#include "roxel/camera/camera.h"

namespace roxel {

/// An interval of depth.
struct FrustumRange {
  double near = 0;
  double far = std::numeric_limits<double>::infinity();
};

/// World positions of the corners: first the four at `near`, then the four at `far` (finite), each clockwise
/// from the image's top left.
std::array<Eigen::Vector3d, 8> frustum_corners(const PinholeCamera& camera, const FrustumRange& range);

/// Whether the point projects into the image (edges included) with a positive depth within `range`.
bool sees(const PinholeCamera& camera, const Eigen::Vector3d& x_in_world, const FrustumRange& range = {});

/// Whether any part of the box lies in the frustum; exact (separating axes), touching counts.
bool sees_box(const PinholeCamera& camera, const Eigen::AlignedBox3d& box, const FrustumRange& range = {});

}  // namespace roxel

#pragma once
/// Where synthetic photographs are taken from.

#include <Eigen/Core>
#include <vector>

#include "roxel/camera/camera.h"

namespace roxel {

/// A camera that sees `target` in the image's middle, up being up (north, where it looks straight down or
/// up).
Pose looking_at(const Eigen::Vector3d& centre, const Eigen::Vector3d& target);

/// Square pixels, the principal point in the middle; `focal_share` is the focal length as a share of the
/// image's smaller side.
Intrinsics simple_intrinsics(int width, int height, double focal_share);

/// A point at this distance and direction (degrees; azimuth from +X to +Y) from `target`.
Eigen::Vector3d around(const Eigen::Vector3d& target, double distance, double azimuth_deg,
                       double elevation_deg);

/// Directions of twenty images of 54 x 44 degrees that tile the sky and a little below the horizon.
std::vector<Eigen::Vector3d> hemisphere_directions();

}  // namespace roxel

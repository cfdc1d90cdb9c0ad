#pragma once
/// Which places on a surface cameras see: nothing of the surface itself may be in between.

#include <span>
#include <vector>

#include "roxel/camera/camera.h"
#include "roxel/surface/mesh.h"

namespace roxel {

/// Whether a place is in front of the camera and falls on its image.
bool in_image(const PinholeCamera& camera, const Eigen::Vector3d& x);

/// The number of cameras that see each point: it projects into the image, and the straight line to the camera
/// meets no triangle before the last kSightMargin of its length. Points that lie on the surface see
/// themselves. The same for any number of threads.
std::vector<int> count_sightings(const Mesh& surface, std::span<const Eigen::Vector3d> points,
                                 std::span<const PinholeCamera> cameras, int threads);
inline constexpr double kSightMargin = 1e-4;  ///< floats err by 1e-6 of the extent; a grazing ray needs more

}  // namespace roxel

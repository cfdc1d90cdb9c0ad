#pragma once
/// Pictures of a surface for people: shaded, or in its own colours, from any camera.

#include <functional>

#include "roxel/camera/camera.h"
#include "roxel/image/image.h"
#include "roxel/surface/mesh_rays.h"
#include "roxel/surface/surface.h"

namespace roxel {

/// What colour a hit has: linear RGB.
using HitColor = std::function<std::array<float, 3>(const MeshHit& hit)>;

struct MeshPictureOptions {
  int samples = 2;  ///< rays a pixel, along an axis
  int threads = 1;
  std::array<float, 3> background{0.25f, 0.25f, 0.27f};  ///< display values
};

/// Grey, lit from the viewer's upper left; surfaces seen from behind are brown. Display values.
Image shaded_picture(const Surface& surface, const MeshRays& rays, const PinholeCamera& camera,
                     const MeshPictureOptions& options);

/// In the colours of its hits, encoded as sRGB. Display values.
Image colored_picture(const MeshRays& rays, const PinholeCamera& camera, const HitColor& color,
                      const MeshPictureOptions& options);

/// Colours between a triangle's points; the surface must have colours and outlive the function.
HitColor point_colors(const Surface& surface);

/// A camera that looks at the middle of a ball from `direction` (from the middle to the camera), so that it
/// fills the square picture; `up` is up in the picture.
PinholeCamera orbit_camera(const Eigen::Vector3d& middle, double radius, const Eigen::Vector3d& direction,
                           const Eigen::Vector3d& up, int size_px);

}  // namespace roxel

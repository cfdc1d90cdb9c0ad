#pragma once
/// A surface as one pixel sees it: a plane. Inverse depth is affine in pixel coordinates on a plane, so
/// w(u, v) = 1 / z = w + wu (u - u0) + wv (v - v0), with (u0, v0) the pixel's centre (docs/depth.md).

#include <Eigen/Core>
#include <vector>

#include "roxel/camera/camera.h"
#include "roxel/image/image.h"

namespace roxel {

struct PixelPlane {
  float w = 0;   ///< inverse depth, 1 / world units; 0 = no surface
  float wu = 0;  ///< its change from a pixel to the next
  float wv = 0;

  bool empty() const { return w <= 0; }
  /// Inverse depth (du, dv) pixels away.
  float at(float du, float dv) const { return w + wu * du + wv * dv; }
};

/// Row-major, one a pixel.
struct PlaneMap {
  PlaneMap() = default;
  PlaneMap(int columns, int rows)
      : width(columns), height(rows), planes(static_cast<std::size_t>(columns) * rows) {}
  int width = 0;
  int height = 0;
  std::vector<PixelPlane> planes;
  PixelPlane& at(int x, int y) { return planes[static_cast<std::size_t>(y) * width + x]; }
  const PixelPlane& at(int x, int y) const { return planes[static_cast<std::size_t>(y) * width + x]; }
};

/// Unit normal in the world, towards the camera's side, of the plane of the pixel whose centre is (u0, v0).
Eigen::Vector3d world_normal(const PinholeCamera& camera, const PixelPlane& plane, double u0, double v0);

/// The plane through the pixel's ray at depth 1 / w with that normal; slopes are 0 where it is seen edge-on.
PixelPlane plane_of_normal(const PinholeCamera& camera, double w, const Eigen::Vector3d& normal, double u0,
                           double v0);

/// Planes with the slope of each pixel's neighbours within `radius` pixels, as they agree with the pixel:
/// least squares, weighted by 1 / variance, neighbours behind a gap in depth left out; they pass through the
/// pixel's own depth. Pixels without depth (0) have none.
PlaneMap fit_planes(const Image& depth, const Image& variance, double focal_px, int radius, int threads = 1);

}  // namespace roxel

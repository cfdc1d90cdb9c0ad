#include "roxel/depth/pixel_plane.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace roxel {
namespace {

constexpr float kSteepest = 3;  ///< slope that a neighbour may lie on before anything is known of the plane
constexpr float kGapSigma = 2.5f;  ///< deviations at which a neighbour counts half

/// Weighted sums of the normal equations of w = a + b du + c dv.
struct PlaneSums {
  double n = 0, u = 0, v = 0, uu = 0, uv = 0, vv = 0, w = 0, uw = 0, vw = 0;

  void add(double weight, double du, double dv, double value) {
    n += weight;
    u += weight * du;
    v += weight * dv;
    uu += weight * du * du;
    uv += weight * du * dv;
    vv += weight * dv * dv;
    w += weight * value;
    uw += weight * du * value;
    vw += weight * dv * value;
  }
  /// Slopes shrink to 0 where neighbours do not span them.
  bool solve(double& a, double& b, double& c) const {
    if (!(n > 0)) return false;
    const double mu = u / n, mv = v / n, mw = w / n;
    const double ridge = 0.02;
    const double suu = uu / n - mu * mu + ridge, suv = uv / n - mu * mv, svv = vv / n - mv * mv + ridge;
    const double suw = uw / n - mu * mw, svw = vw / n - mv * mw;
    const double determinant = suu * svv - suv * suv;
    if (!(determinant > 0)) return false;
    b = (suw * svv - svw * suv) / determinant;
    c = (svw * suu - suw * suv) / determinant;
    a = mw - b * mu - c * mv;
    return true;
  }
};

}  // namespace

Eigen::Vector3d world_normal(const PinholeCamera& camera, const PixelPlane& plane, double u0, double v0) {
  const Intrinsics& k = camera.intrinsics;
  const Eigen::Vector2d x = normalised_from_pixel(k, {u0, v0});
  const double wx = plane.wu * k.fx, wy = plane.wv * k.fy + plane.wu * k.skew;
  const Eigen::Vector3d away(wx, wy, plane.w - x.x() * wx - x.y() * wy);  // N . X = 1 on the plane
  return camera.pose.rotation.transpose() * -away.normalized();
}

PixelPlane plane_of_normal(const PinholeCamera& camera, double w, const Eigen::Vector3d& normal, double u0,
                           double v0) {
  const Intrinsics& k = camera.intrinsics;
  const Eigen::Vector3d x = normalised_from_pixel(k, {u0, v0}).homogeneous();
  const Eigen::Vector3d n = camera.pose.rotation * normal;
  const double facing = n.dot(x);
  PixelPlane plane{static_cast<float>(w), 0, 0};
  if (std::abs(facing) < 1e-3) return plane;
  const double wx = w * n.x() / facing, wy = w * n.y() / facing;
  plane.wu = static_cast<float>(wx / k.fx);
  plane.wv = static_cast<float>((wy - plane.wu * k.skew) / k.fy);
  return plane;
}

PlaneMap fit_planes(const Image& depth, const Image& variance, double focal_px, int radius, bool fitted) {
  const int width = depth.width(), height = depth.height();
  PlaneMap map(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float z = *depth.pixel(x, y);
      if (!(z > 0)) continue;
      const double w0 = 1.0 / z;
      const double own = std::max(1e-12f * z * z, *variance.pixel(x, y));
      double a = w0, b = 0, c = 0;
      for (int round = 0; round < 3; ++round) {
        PlaneSums sums;
        for (int dy = -radius; dy <= radius; ++dy)
          for (int dx = -radius; dx <= radius; ++dx) {
            const int nx = x + dx, ny = y + dy;
            if (nx < 0 || ny < 0 || nx >= width || ny >= height) continue;
            const float zn = *depth.pixel(nx, ny);
            if (!(zn > 0)) continue;
            const double vn = std::max(1e-12f * z * z, *variance.pixel(nx, ny));
            double expected = z, scale = vn + own;
            if (round == 0) {
              const double slope = kSteepest * std::hypot(dx, dy) * z / focal_px;
              scale += slope * slope;
            } else {
              expected = 1 / std::max(1e-6 * w0, a + b * dx + c * dy);
            }
            const double gap = (zn - expected) * (zn - expected) / (kGapSigma * kGapSigma * scale);
            if (gap > 4) continue;
            sums.add(1 / ((1 + gap * gap) * (vn + own)), dx, dy, 1.0 / zn);
          }
        if (!sums.solve(a, b, c)) a = w0, b = c = 0;
      }
      if (!fitted || !(a > 0.5 * w0 && a < 2 * w0)) a = w0;
      map.at(x, y) = {static_cast<float>(a), static_cast<float>(b), static_cast<float>(c)};
    }
  return map;
}

}  // namespace roxel

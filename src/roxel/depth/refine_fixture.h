#pragma once
/// Views of a textured plane, drawn in closed form.

#include <cmath>

#include "roxel/depth/refine_view.h"

namespace roxel::fixture {

/// z = 4 + 0.3 x - 0.2 y in the world; cameras around the origin look along z.
struct SlantedPlane {
  static constexpr double kZ = 4, kX = 0.3, kY = -0.2;

  /// `size`: times as many pixels along each side.
  static PinholeCamera camera(double x, double y, int size = 1) {
    PinholeCamera camera;
    const double k = size;
    camera.intrinsics = {72 * size, 56 * size, 90 * k, 90 * k, 36 * k, 28 * k, 0};
    camera.pose.centre = {x, y, 0};
    return camera;
  }
  static double depth(const Ray& ray) {
    return (kZ - ray.origin.z() + kX * ray.origin.x() + kY * ray.origin.y()) /
           (ray.direction.z() - kX * ray.direction.x() - kY * ray.direction.y());
  }
  /// Between 0 and 1; about five pixels a period.
  static double texture(const Eigen::Vector3d& x) {
    return 0.5 + 0.15 * std::sin(23 * x.x() + 5 * x.y()) + 0.15 * std::cos(19 * x.y() - 7 * x.x()) +
           0.1 * std::sin(11 * x.x() * x.y());
  }
  static Eigen::Vector3d normal() { return Eigen::Vector3d(kX, kY, -1).normalized(); }

  /// `light`: gain of the photograph. Depth is off by `error` plus `ripple` from pixel to pixel.
  static MatchView view(double x, double y, double light, double error, double ripple, int size = 1) {
    const int width = 72 * size, height = 56 * size;
    MatchView out{
        camera(x, y, size), Image(width, height, 1), {}, Image(width, height, 1), Image(width, height, 1)};
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) {
        const Ray ray = out.camera.ray(u + 0.5, v + 0.5);
        const double z = depth(ray);
        *out.luma.pixel(u, v) = static_cast<float>(light * texture(ray.origin + z * ray.direction));
        *out.depth.pixel(u, v) =
            static_cast<float>(z + error + ripple * std::sin(1.7 * u) * std::cos(2.3 * v));
        *out.variance.pixel(u, v) = 0.05f * 0.05f;
      }
    return out;
  }
};

}  // namespace roxel::fixture

#include "roxel/synth/light_filter.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace roxel {
namespace {

using Eigen::Vector3f;

Eigen::Map<const Vector3f> at(const Image& image, int x, int y) {
  return Eigen::Map<const Vector3f>(image.pixel(x, y));
}

/// Surface points relative to the camera.
Image positions(const SurfaceGuide& guide, const PinholeCamera& camera) {
  Image points(guide.depth.width(), guide.depth.height(), 3);
  for (int y = 0; y < points.height(); ++y)
    for (int x = 0; x < points.width(); ++x)
      Eigen::Map<Vector3f>(points.pixel(x, y)) =
          *guide.depth.pixel(x, y) * camera.ray(x + 0.5, y + 0.5).direction.cast<float>();
  return points;
}

struct Filter {
  const SurfaceGuide& guide;
  const Image& points;
  float pixel_slope;  ///< width of a pixel at distance 1

  /// How far two surface points are one surface: 1 in one plane, 0 around a corner or at another depth.
  float kinship(int x, int y, int i, int j) const {
    if (!(*guide.depth.pixel(i, j) > 0)) return 0;
    const Vector3f n = at(guide.normal, x, y);
    const float alike = n.dot(at(guide.normal, i, j));
    if (alike < 0.8f) return 0;
    const float off_plane = std::abs(n.dot(at(points, i, j) - at(points, x, y)));
    const float tolerance = 2 * pixel_slope * *guide.depth.pixel(x, y);
    const float squared = alike * alike, fourth = squared * squared, eighth = fourth * fourth;
    return eighth * eighth / (1 + (off_plane / tolerance) * (off_plane / tolerance));
  }

  Vector3f mean_around(const Image& light, int x, int y, int step) const {
    static constexpr float kSpline[5] = {1 / 16.0f, 1 / 4.0f, 3 / 8.0f, 1 / 4.0f, 1 / 16.0f};
    Vector3f sum = Vector3f::Zero();
    float weights = 0;
    for (int dy = -2; dy <= 2; ++dy)
      for (int dx = -2; dx <= 2; ++dx) {
        const int i = x + dx * step, j = y + dy * step;
        if (i < 0 || j < 0 || i >= light.width() || j >= light.height()) continue;
        const float weight = kSpline[dx + 2] * kSpline[dy + 2] * kinship(x, y, i, j);
        sum += weight * at(light, i, j);
        weights += weight;
      }
    return sum / weights;
  }
};

}  // namespace

Image smoothed_light(Image light, const SurfaceGuide& guide, const PinholeCamera& camera, int passes) {
  const Image points = positions(guide, camera);
  const Filter filter{guide, points, static_cast<float>(1 / camera.intrinsics.fx)};
  for (int pass = 0; pass < passes; ++pass) {
    const Image before = light;
    for (int y = 0; y < light.height(); ++y)
      for (int x = 0; x < light.width(); ++x)
        if (*guide.depth.pixel(x, y) > 0)
          Eigen::Map<Vector3f>(light.pixel(x, y)) = filter.mean_around(before, x, y, 1 << pass);
  }
  return light;
}

}  // namespace roxel

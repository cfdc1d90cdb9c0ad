#include "roxel/depth/agree_views.h"

#include <cmath>
#include <optional>

#include "roxel/base/parallel.h"

namespace roxel {
namespace {

constexpr double kAgreeSigmas = 3;  ///< deviations within which two views speak of one surface

/// What another view says of the inverse depth along a ray.
struct Opinion {
  double w = 0, variance = 0;
};

/// The plane of the pixel that the ray's surface falls on there, met by the ray.
std::optional<Opinion> ask(const AgreeingView& other, const Eigen::Vector3d& pixel, double w) {
  const Eigen::Vector3d far = other.warp.from_pixel * pixel;
  const Eigen::Vector3d h = far + w * other.warp.parallax;
  if (!(h.z() > 0)) return {};
  const double u = h.x() / h.z(), v = h.y() / h.z();
  const PlaneMap& planes = other.view->planes;
  if (!(u >= 0 && v >= 0 && u < planes.width && v < planes.height)) return {};
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const PixelPlane& plane = planes.at(x, y);
  if (plane.empty()) return {};
  // On the plane 1 = p . h / w with h as above.
  const Eigen::Vector3d p(plane.wu, plane.wv, plane.w - plane.wu * (x + 0.5) - plane.wv * (y + 0.5));
  const double facing = 1 - p.dot(other.warp.parallax);
  if (std::abs(facing) < 0.05) return {};
  Opinion opinion;
  opinion.w = p.dot(far) / facing;
  const double scale = h.z() / facing;  // d w / d (inverse depth there)
  opinion.variance = scale * scale * *other.view->variance.pixel(x, y);
  return opinion;
}

}  // namespace

AgreedView agree_views(const RefinedView& own, std::span<const AgreeingView> others,
                       const RunContext& context) {
  const int width = own.planes.width, height = own.planes.height;
  AgreedView out{own.planes, own.variance, Image(width, height, 1)};
  parallel_for(height, context.thread_count(), [&](std::int64_t row, int) {
    context.throw_if_cancelled();
    const int y = static_cast<int>(row);
    for (int x = 0; x < width; ++x) {
      PixelPlane& plane = out.planes.at(x, y);
      if (plane.empty()) continue;
      const double w = plane.w, variance = *own.variance.pixel(x, y);
      double weight = 1 / variance, first = 0, second = 0;
      int agreeing = 0;
      for (const AgreeingView& other : others) {
        const auto opinion = ask(other, Eigen::Vector3d(x + 0.5, y + 0.5, 1), w);
        if (!opinion || !(opinion->variance > 0)) continue;
        const double off = opinion->w - w;
        if (off * off > kAgreeSigmas * kAgreeSigmas * (variance + opinion->variance)) continue;
        weight += 1 / opinion->variance;
        first += off / opinion->variance;
        second += off * off / opinion->variance;
        ++agreeing;
      }
      *out.views.pixel(x, y) = static_cast<float>(agreeing);
      if (agreeing == 0) continue;
      const double mean = first / weight;
      const double chi2 = (second - mean * first) / agreeing;
      plane.w = static_cast<float>(w + mean);
      *out.variance.pixel(x, y) = static_cast<float>(std::max(1.0, chi2) / weight);
    }
  });
  return out;
}

}  // namespace roxel

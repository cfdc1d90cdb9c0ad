#include "roxel/eval/depth_points.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/parallel.h"

namespace roxel {
namespace {

/// Whether the map has a depth near that of x, at the pixel that x falls on.
bool agrees(const ViewDepth& view, const Eigen::Vector3d& x, double tolerance) {
  const Eigen::Vector3d uvz = view.camera.project(x);
  if (!(uvz.z() > 0 && uvz.x() >= 0 && uvz.x() < view.depth.width() && uvz.y() >= 0 &&
        uvz.y() < view.depth.height()))
    return false;
  const float z = *view.depth.pixel(static_cast<int>(uvz.x()), static_cast<int>(uvz.y()));
  return z > 0 && std::abs(z - uvz.z()) <= tolerance;
}

bool enough_agree(const std::vector<ViewDepth>& views, std::size_t own, const Eigen::Vector3d& x,
                  const DepthPointOptions& options) {
  int agreeing = 1;
  for (std::size_t v = 0; v < views.size() && agreeing < options.views_that_agree; ++v)
    agreeing += v != own && agrees(views[v], x, options.tolerance);
  return agreeing >= options.views_that_agree;
}

}  // namespace

std::vector<Eigen::Vector3d> depth_points(const std::vector<ViewDepth>& views,
                                          const DepthPointOptions& options, int threads) {
  std::vector<std::vector<Eigen::Vector3d>> of_view(views.size());
  parallel_for(static_cast<std::int64_t>(views.size()), threads, [&](std::int64_t v, int) {
    const ViewDepth& view = views[v];
    for (int y = options.stride / 2; y < view.depth.height(); y += options.stride)
      for (int x = options.stride / 2; x < view.depth.width(); x += options.stride) {
        const float z = *view.depth.pixel(x, y);
        if (!(z > 0 && std::isfinite(z))) continue;
        const Ray ray = view.camera.ray(x + 0.5, y + 0.5);
        const Eigen::Vector3d point = ray.origin + z * ray.direction;
        if (enough_agree(views, v, point, options)) of_view[v].push_back(point);
      }
  });
  std::vector<Eigen::Vector3d> points;
  for (const auto& some : of_view) points.insert(points.end(), some.begin(), some.end());
  return points;
}

int pixel_stride(const std::vector<ViewDepth>& views, std::int64_t most) {
  const auto counted = [](int pixels, int stride) { return (pixels - stride / 2 + stride - 1) / stride; };
  for (int stride = 1;; ++stride) {
    std::int64_t pixels = 0;
    bool one_each = true;
    for (const ViewDepth& view : views) {
      const std::int64_t across = std::max(0, counted(view.depth.width(), stride)),
                         down = std::max(0, counted(view.depth.height(), stride));
      pixels += across * down;
      one_each &= across <= 1 && down <= 1;
    }
    if (pixels <= most || one_each) return stride;
  }
}

}  // namespace roxel

#include "roxel/depth/pixel_plane.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "roxel/base/kernel.h"
#include "roxel/base/parallel.h"

namespace roxel {
namespace {

constexpr float kSteepest = 3;  ///< slope that a neighbour may lie on before anything is known of the plane
constexpr float kGapSigma = 2.5f;  ///< deviations at which a neighbour counts half
constexpr float kFarthestGap = 4;  ///< in units of kGapSigma squared: beyond it a neighbour is left out
constexpr float kRidge = 0.02f;    ///< squared pixels: slopes shrink to 0 where neighbours do not span them
constexpr int kRounds = 3;
constexpr int kSpan = 64;  ///< pixels of a row that are worked on together

/// Pixels of a row: of each its depth, 1 / depth and variance.
struct PixelRow {
  const float *z, *w, *variance;
  PixelRow operator+(int columns) const { return {z + columns, w + columns, variance + columns}; }
};

/// Of a span of pixels: weighted sums of the normal equations of w - w0 = a + b du + c dv, and the solution.
struct PlaneSpan {
  std::array<float, kSpan> n, u, v, uu, uv, vv, w, uw, vw;
  std::array<float, kSpan> a, b, c;

  void clear() {
    for (auto* sums : {&n, &u, &v, &uu, &uv, &vv, &w, &uw, &vw}) sums->fill(0);
  }
};

/// Adds the neighbours (du, dv) away. `slope`: what depth may differ by for its own sake, over the depth.
ROXEL_KERNEL void add_neighbours(PixelRow own, PixelRow next, int begin, int end, float du, float dv,
                                 float slope, PlaneSpan& __restrict span) {
  for (int i = begin; i < end; ++i) {
    const float z = own.z[i], w0 = own.w[i], zn = next.z[i];
    const float least = 1e-12f * z * z;
    const float theirs = next.variance[i], ours = own.variance[i];
    const float variance = (theirs > least ? theirs : least) + (ours > least ? ours : least);
    const float there = w0 + span.a[i] + span.b[i] * du + span.c[i] * dv, nearly = 1e-6f * w0;
    const float expected = 1 / (there > nearly ? there : nearly);
    const float off = zn - expected, steep = slope * z;
    const float gap = off * off / (kGapSigma * kGapSigma * (variance + steep * steep));
    const float fits = 1 / ((1 + gap * gap) * variance);
    const float weight = (zn > 0) & (gap <= kFarthestGap) ? fits : 0;
    const float value = next.w[i] - w0, wu = weight * du, wv = weight * dv;
    span.n[i] += weight;
    span.u[i] += wu;
    span.v[i] += wv;
    span.uu[i] += wu * du;
    span.uv[i] += wu * dv;
    span.vv[i] += wv * dv;
    span.w[i] += weight * value;
    span.uw[i] += wu * value;
    span.vw[i] += wv * value;
  }
}

ROXEL_KERNEL void solve(int count, PlaneSpan& __restrict span) {
  for (int i = 0; i < count; ++i) {
    const float scale = 1 / span.n[i];
    const float mu = span.u[i] * scale, mv = span.v[i] * scale, mw = span.w[i] * scale;
    const float suu = span.uu[i] * scale - mu * mu + kRidge, svv = span.vv[i] * scale - mv * mv + kRidge;
    const float suv = span.uv[i] * scale - mu * mv;
    const float suw = span.uw[i] * scale - mu * mw, svw = span.vw[i] * scale - mv * mw;
    const float determinant = suu * svv - suv * suv;
    const float b = (suw * svv - svw * suv) / determinant, c = (svw * suu - suw * suv) / determinant;
    const bool solved = span.n[i] > 0 && determinant > 0;
    span.a[i] = solved ? mw - b * mu - c * mv : 0;
    span.b[i] = solved ? b : 0;
    span.c[i] = solved ? c : 0;
  }
}

/// Fits planes to the depths of one view.
class PlaneFit {
 public:
  PlaneFit(const Image& depth, const Image& variance, double focal_px, int radius)
      : depth_(depth), variance_(variance), inverse_(depth), focal_px_(focal_px), radius_(radius) {
    for (float& z : inverse_.data()) z = z > 0 ? 1 / z : 0;
  }

  void fit(int y, int first, int count, PlaneSpan& span) const {
    span.a.fill(0);
    span.b.fill(0);
    span.c.fill(0);
    const PixelRow own = row(y) + first;
    for (int round = 0; round < kRounds; ++round) {
      span.clear();
      for (int dy = std::max(-radius_, -y); dy <= std::min(radius_, depth_.height() - 1 - y); ++dy)
        for (int dx = -radius_; dx <= radius_; ++dx) {
          const int begin = std::max(0, -dx - first), end = std::min(count, depth_.width() - dx - first);
          const double slope = round == 0 ? kSteepest * std::hypot(dx, dy) / focal_px_ : 0;
          add_neighbours(own, row(y + dy) + (first + dx), begin, end, static_cast<float>(dx),
                         static_cast<float>(dy), static_cast<float>(slope), span);
        }
      solve(count, span);
    }
  }
  float inverse_depth(int x, int y) const { return *inverse_.pixel(x, y); }

 private:
  PixelRow row(int y) const { return {depth_.pixel(0, y), inverse_.pixel(0, y), variance_.pixel(0, y)}; }

  const Image &depth_, &variance_;
  Image inverse_;
  double focal_px_;
  int radius_;
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

PlaneMap fit_planes(const Image& depth, const Image& variance, double focal_px, int radius, int threads) {
  const int width = depth.width(), height = depth.height();
  PlaneMap map(width, height);
  const PlaneFit planes(depth, variance, focal_px, radius);
  parallel_for(height, threads, [&](std::int64_t row, int) {
    const int y = static_cast<int>(row);
    PlaneSpan span;
    for (int first = 0; first < width; first += kSpan) {
      const int count = std::min(kSpan, width - first);
      const float* z = depth.pixel(first, y);
      if (std::none_of(z, z + count, [](float d) { return d > 0; })) continue;
      planes.fit(y, first, count, span);
      for (int i = 0; i < count; ++i)
        if (z[i] > 0) map.at(first + i, y) = {planes.inverse_depth(first + i, y), span.b[i], span.c[i]};
    }
  });
  return map;
}

}  // namespace roxel

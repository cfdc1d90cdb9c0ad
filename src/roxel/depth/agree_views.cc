#include "roxel/depth/agree_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "roxel/base/parallel.h"

namespace roxel {
namespace {

constexpr double kAgreeSigmas = 3;       ///< deviations within which two views speak of one surface
constexpr double kFarthest = 0.02;       ///< relative difference of depth that is another surface
constexpr double kMedianSigma = 0.6745;  ///< median of |x| of a standard Gaussian
constexpr double kShared = 0.5;          ///< of a view's own variance, what is left when several are averaged
constexpr double kMostShared = 0.5;      ///< of a variance, where a pixel is asked how views differ
constexpr int kRoughStep = 3;            ///< pixels to the neighbours that are asked how rough the map is
constexpr double kRoughness = 0.7;       ///< deviations that the median difference from them stands for
constexpr int kBins = 2000;              ///< of differences over deviations,
constexpr double kBinsPerSigma = 50;     ///< up to 40

/// What another view says of the inverse depth along a ray.
struct Opinion {
  double w = 0;
  double own = 0;        ///< variance that is this view's alone
  double shared = 0;     ///< and that views have in common
  bool matched = false;  ///< photographs said something of it
  double total() const { return own + shared; }
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
  const double variance = *other.view->variance.pixel(x, y);
  if (plane.empty() || !(variance > 0)) return {};
  // On the plane 1 = p . h / w with h as above.
  const Eigen::Vector3d p(plane.wu, plane.wv, plane.w - plane.wu * (x + 0.5) - plane.wv * (y + 0.5));
  const double facing = 1 - p.dot(other.warp.parallax);
  if (std::abs(facing) < 0.05) return {};
  const double scale = h.z() / facing;  // d w / d (inverse depth there)
  const double shared = std::min<double>(variance, *other.view->shared.pixel(x, y));
  const Opinion opinion{p.dot(far) / facing, scale * scale * (variance - shared), scale * scale * shared,
                        *other.view->correlation.pixel(x, y) > 0};
  if (!(std::abs(opinion.w - w) < kFarthest * w)) return {};
  return opinion;
}

/// Asks for one view, row by row.
class ViewAgreement {
 public:
  ViewAgreement(const RefinedView& own, std::span<const AgreeingView> others, const RunContext& context)
      : own_(own), others_(others), context_(context) {}

  AgreedView join() {
    const double stretch = measure_stretch();
    AgreedView out{own_.planes, own_.variance, Image(own_.planes.width, own_.planes.height, 1), stretch};
    for_each_row([&](int y) {
      for (int x = 0; x < own_.planes.width; ++x) join_pixel(x, y, stretch, out);
    });
    return out;
  }

 private:
  template <class Body>
  void for_each_row(const Body& body) const {
    parallel_for(own_.planes.height, context_.thread_count(), [&](std::int64_t row, int) {
      context_.throw_if_cancelled();
      body(static_cast<int>(row));
    });
  }

  /// Median of the differences between views over their deviations, against what it should be.
  double measure_stretch() const {
    std::vector<std::vector<std::int64_t>> rows(own_.planes.height);
    for_each_row([&](int y) {
      rows[y].assign(kBins, 0);
      for (int x = 0; x < own_.planes.width; ++x) {
        const PixelPlane& plane = own_.planes.at(x, y);
        if (plane.empty()) continue;
        const Opinion mine = own_opinion(x, y);
        if (mine.shared > kMostShared * mine.total()) continue;
        for (const AgreeingView& other : others_) {
          const auto opinion = ask(other, {x + 0.5, y + 0.5, 1}, plane.w);
          if (!opinion || opinion->shared > kMostShared * opinion->total()) continue;
          const double off = std::abs(opinion->w - plane.w) / std::sqrt(mine.own + opinion->own);
          ++rows[y][static_cast<std::size_t>(std::min(off * kBinsPerSigma, kBins - 1.0))];
        }
      }
    });
    std::vector<std::int64_t> bins(kBins, 0);
    for (const auto& row : rows)
      for (int b = 0; b < kBins; ++b) bins[b] += row[b];
    const std::int64_t total = std::accumulate(bins.begin(), bins.end(), std::int64_t{0});
    if (total == 0) return 1;
    std::int64_t count = 0;
    int bin = 0;
    while (bin + 1 < kBins && 2 * (count + bins[bin]) < total) count += bins[bin++];
    return std::max(1.0, (bin + 0.5) / kBinsPerSigma / kMedianSigma);
  }

  void join_pixel(int x, int y, double stretch, AgreedView& out) const {
    PixelPlane& plane = out.planes.at(x, y);
    if (plane.empty()) return;
    const double w = plane.w;
    Opinion mine = own_opinion(x, y);
    mine.own *= stretch * stretch;
    double weight = 1 / mine.total(), first = 0, second = 0;
    double shared = weight * mine.shared, own = weight * mine.own;
    int agreeing = 0, confirming = 0;
    for (const AgreeingView& other : others_) {
      auto opinion = ask(other, {x + 0.5, y + 0.5, 1}, w);
      if (!opinion) continue;
      opinion->own *= stretch * stretch;
      const double off = opinion->w - w, k = 1 / opinion->total();
      if (off * off > kAgreeSigmas * kAgreeSigmas * (mine.total() + opinion->total())) continue;
      weight += k;
      first += k * off;
      second += k * off * off;
      shared += k * opinion->shared;
      own += k * opinion->own;
      ++agreeing;
      confirming += opinion->matched;
    }
    *out.views.pixel(x, y) = static_cast<float>(confirming);
    const double mean = first / weight;
    const double chi2 = agreeing > 0 ? std::max(1.0, (second - mean * first) / agreeing) : 1;
    plane.w = static_cast<float>(w + mean);
    // Views are made from the same few photographs: of what is a view's own, a part goes with their number.
    const double rough = kRoughness * roughness(x, y);
    *out.variance.pixel(x, y) = static_cast<float>(chi2 * (shared + kShared * own) / weight + rough * rough);
  }

  /// What neighbours' planes say of this pixel differs by so much from its own: where patches err, and where
  /// the surface is no plane, they do so each in its way.
  double roughness(int x, int y) const {
    const PixelPlane& plane = own_.planes.at(x, y);
    std::array<float, 8> differences;
    int count = 0;
    for (int dy = -kRoughStep; dy <= kRoughStep; dy += kRoughStep)
      for (int dx = -kRoughStep; dx <= kRoughStep; dx += kRoughStep) {
        const int nx = x + dx, ny = y + dy;
        if ((dx == 0 && dy == 0) || nx < 0 || ny < 0 || nx >= own_.planes.width || ny >= own_.planes.height)
          continue;
        const PixelPlane& other = own_.planes.at(nx, ny);
        if (other.empty()) continue;
        differences[count++] = std::abs(other.at(static_cast<float>(-dx), static_cast<float>(-dy)) - plane.w);
      }
    if (count == 0) return 0;
    std::nth_element(differences.begin(), differences.begin() + count / 2, differences.begin() + count);
    return differences[count / 2];
  }

  Opinion own_opinion(int x, int y) const {
    const double variance = *own_.variance.pixel(x, y), shared = *own_.shared.pixel(x, y);
    return {own_.planes.at(x, y).w, std::max(0.0, variance - shared), std::min(variance, shared)};
  }

  const RefinedView& own_;
  std::span<const AgreeingView> others_;
  const RunContext& context_;
};

}  // namespace

AgreedView agree_views(const RefinedView& own, std::span<const AgreeingView> others,
                       const RunContext& context) {
  return ViewAgreement(own, others, context).join();
}

}  // namespace roxel

#include "roxel/depth/refine_view.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/LU>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"

namespace roxel {
namespace {

constexpr float kNoCost = std::numeric_limits<float>::infinity();
constexpr float kWorstMatch = 0.8f;          ///< 1 - correlation beyond which views are equally wrong
constexpr double kModelNoise = 0.02;         ///< share of a patch's variance that no plane explains
constexpr double kIndependent = 0.25;        ///< share of a patch's samples that err independently
constexpr double kIndependentErrors = 0.25;  ///< the same, for how far a depth may be off
constexpr double kVolumeStretch =
    1.5;                          ///< of the variance that rests on the volume: its errors are alike nearby
constexpr float kFreedom = 4;     ///< of the Student distribution of the volume's errors
constexpr float kFirstReach = 6;  ///< deviations that the first random plane may be off
constexpr double kSlopeSigma = 0.6;      ///< tangent by which the volume's normals err
constexpr double kSteepestPlane = 6;     ///< tangent of the steepest plane
constexpr float kLeastAgreement = 0.4f;  ///< correlation of a view that counts in the least squares
constexpr int kLeastSquaresRounds = 3;
constexpr double kStill = 0.02;      ///< step, in deviations, that ends the least squares
constexpr double kSamePlane = 0.03;  ///< pixels that planes differ by in other views at most
constexpr int kViewsAPixel = 6;      ///< of the sources, those that show the patch best

/// Well mixed bits of a few numbers [Steele14].
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// Numbers in [-1, 1) that depend on the seed, the pixel and the round alone.
class PixelDice {
 public:
  PixelDice(std::int64_t seed, std::size_t pixel, int round)
      : state_(mix(static_cast<std::uint64_t>(seed) ^ mix(pixel * 64 + round))) {}
  float roll() {
    state_ = mix(state_);
    return static_cast<float>(state_ >> 40) * (2.0f / (1 << 24)) - 1;
  }

 private:
  std::uint64_t state_;
};

/// What a plane is worth at one pixel.
struct Hypothesis {
  PixelPlane plane;
  float cost = kNoCost;        ///< negative log-likelihood and -prior
  float correlation = 0;       ///< mean over the views that agree best
  std::uint32_t agreeing = 0;  ///< those views
  int since = 0;               ///< the half round that found it
};

/// Refines a view, round by round.
class ViewRefinement {
 public:
  ViewRefinement(const MatchView& view, std::span<const MatchView* const> sources, const PlaneMap& start,
                 const PatchMatchOptions& options, const RunContext& context)
      : view_(view),
        start_(start),
        options_(options),
        context_(context),
        width_(start.width),
        height_(start.height),
        focal_(0.5f * static_cast<float>(view.camera.intrinsics.fx + view.camera.intrinsics.fy)),
        best_(start.planes.size()),
        visible_(start.planes.size(), 0) {
    ROXEL_CHECK(sources.size() <= 32);
    for (const MatchView* source : sources) {
      source_views_.push_back(source);
      sources_.push_back({&source->luma, PatchWarp(view.camera, source->camera)});
    }
  }

  RefinedView run() {
    for_each_pixel(-1, [&](int x, int y, std::size_t i) { begin(x, y, i); });
    for (int round = 0; round < options_.iterations; ++round)
      for (int color = 0; color < 2; ++color)
        for_each_pixel(color, [&](int x, int y, std::size_t i) { improve(x, y, i, round, color); });
    RefinedView out{PlaneMap(width_, height_), Image(width_, height_, 1), Image(width_, height_, 1),
                    Image(width_, height_, 1)};
    for_each_pixel(-1, [&](int x, int y, std::size_t i) { finish(x, y, i, out); });
    return out;
  }

 private:
  template <class Body>
  void for_each_pixel(int color, const Body& body) const {
    parallel_for(height_, context_.thread_count(), [&](std::int64_t row, int) {
      context_.throw_if_cancelled();
      const int y = static_cast<int>(row);
      const int first = color < 0 ? 0 : (color + y) & 1;
      for (int x = first; x < width_; x += color < 0 ? 1 : 2) {
        const std::size_t i = static_cast<std::size_t>(y) * width_ + x;
        if (!start_.planes[i].empty()) body(x, y, i);
      }
    });
  }

  float sigma_w(std::size_t i) const {
    const float w = start_.planes[i].w;
    return std::max(1e-6f * w, std::sqrt(view_.variance.data()[i]) * w * w);
  }

  /// The sources that see the pixel's surface, by their own depth maps; `variance` of the depth besides
  /// theirs.
  std::uint32_t seen_by(int x, int y, const PixelPlane& plane, float variance) const {
    std::uint32_t seen = 0;
    for (std::size_t s = 0; s < sources_.size(); ++s) {
      const PatchWarp& warp = sources_[s].warp;
      const Eigen::Vector3d h =
          warp.from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1) + plane.w * warp.parallax;
      if (!(h.z() > 0)) continue;
      const double u = h.x() / h.z(), v = h.y() / h.z();
      const MatchView& source = *source_views_[s];
      if (!(u >= 1 && v >= 1 && u < source.depth.width() - 1 && v < source.depth.height() - 1)) continue;
      const double z = h.z() / plane.w;
      bool same = false;
      for (int dy = -1; dy <= 1 && !same; ++dy)
        for (int dx = -1; dx <= 1 && !same; ++dx) {
          const int sx = static_cast<int>(u) + dx, sy = static_cast<int>(v) + dy;
          const float other = *source.depth.pixel(sx, sy);
          if (!(other > 0)) continue;
          const double spread = variance + *source.variance.pixel(sx, sy);
          same = (z - other) * (z - other) < 9 * spread;
        }
      if (same) seen |= 1u << s;
    }
    return seen;
  }

  /// No cost where that would be `limit` or more: then not all views are looked at.
  Hypothesis judge(const Patch& patch, const PixelPlane& plane, std::size_t i, float limit = kNoCost) const {
    Hypothesis out{plane, kNoCost, 0, 0};
    const PixelPlane& start = start_.planes[i];
    const float sigma = sigma_w(i);
    const float off = (plane.w - start.w) / sigma;
    if (!(plane.w > 0) || std::abs(off) > options_.sigmas) return out;
    const float scale = focal_ / start.w;
    const float tilt_u = (plane.wu - start.wu) * scale, tilt_v = (plane.wv - start.wv) * scale;
    const float steep_u = plane.wu * scale, steep_v = plane.wv * scale;
    if (steep_u * steep_u + steep_v * steep_v > kSteepestPlane * kSteepestPlane) return out;
    const float prior =
        0.5f * (kFreedom + 1) * std::log1p(off * off / kFreedom) +
        0.5f * (tilt_u * tilt_u + tilt_v * tilt_v) / static_cast<float>(kSlopeSigma * kSlopeSigma);
    if (prior >= limit) return out;
    std::array<Patch::Steps, 32> place;
    std::array<int, 32> view;
    int count = 0;
    for (std::uint32_t left = visible_[i]; left != 0; left &= left - 1) {
      view[count] = std::countr_zero(left);
      if (patch.place(sources_[view[count]], plane, place[count])) ++count;
    }
    if (count == 0) return out;
    int used = used_of(count);
    float weight = data_weight(patch) / static_cast<float>(used);
    std::array<std::pair<float, int>, 32> match;  // ascending
    float sum = 0;                                // of the best used - (count - looked at)
    for (int k = 0; k < count; ++k) {
      float correlation = patch.correlation(sources_[view[k]], place[k]);
      while (!std::isfinite(correlation)) {  // it looks past what the photograph shows: as if not placed
        if (--count == 0) return out;
        used = used_of(count);
        weight = data_weight(patch) / static_cast<float>(used);
        if (k == count) break;
        view[k] = view[count];
        place[k] = place[count];
        correlation = patch.correlation(sources_[view[k]], place[k]);
      }
      if (k == count) break;
      const std::pair<float, int> next{std::min(1 - correlation, kWorstMatch), view[k]};
      int at = k;
      for (; at > 0 && next < match[at - 1]; --at) match[at] = match[at - 1];
      match[at] = next;
      sum = 0;
      for (int best = 0; best < used - (count - k - 1); ++best) sum += match[best].first;
      if (prior + weight * sum >= limit) return out;
    }
    sum = 0;
    for (int k = 0; k < used; ++k) sum += match[k].first;
    for (int k = 0; k < used; ++k)
      if (1 - match[k].first > kLeastAgreement) out.agreeing |= 1u << match[k].second;
    out.correlation = 1 - sum / static_cast<float>(used);
    out.cost = prior + weight * sum;
    return out;
  }

  /// Of so many views that see a patch, the best that its cost is of.
  static int used_of(int count) { return std::max(std::min(count, 2), (2 * count + 2) / 3); }

  /// Log-likelihood that a drop of the correlation by 1 costs.
  float data_weight(const Patch& patch) const {
    const double noise = options_.patch.noise * options_.patch.noise;
    return static_cast<float>(kIndependent * patch.sample_count() /
                              (noise / (patch.variance() + 1e-12) + kModelNoise));
  }

  Patch patch_at(int x, int y) const { return Patch(view_.luma, view_.color, start_, x, y, options_.patch); }

  void begin(int x, int y, std::size_t i) {
    best_[i].plane = start_.planes[i];
    visible_[i] = seen_by(x, y, start_.planes[i], view_.variance.data()[i]);
    if (visible_[i] == 0) return;
    const Patch patch = patch_at(x, y);
    if (patch.usable()) {
      keep_best_views(patch, i);
      best_[i] = judge(patch, start_.planes[i], i);
    }
    best_[i].plane = start_.planes[i];
  }

  /// Of many views that see a pixel, those that look most like it.
  void keep_best_views(const Patch& patch, std::size_t i) {
    if (std::popcount(visible_[i]) <= kViewsAPixel) return;
    std::array<std::pair<float, int>, 32> match;
    int count = 0;
    for (std::uint32_t left = visible_[i]; left != 0; left &= left - 1) {
      const int s = std::countr_zero(left);
      const float correlation = patch.correlation(sources_[s], start_.planes[i]);
      if (std::isfinite(correlation)) match[count++] = {-correlation, s};
    }
    std::sort(match.begin(), match.begin() + count);
    visible_[i] = 0;
    for (int k = 0; k < std::min(count, kViewsAPixel); ++k) visible_[i] |= 1u << match[k].second;
  }

  /// Tries the planes of neighbours of the other colour, and random ones ever nearer to the best.
  void improve(int x, int y, std::size_t i, int round, int color) {
    const int now = 2 * round + color + 1;  // half rounds; 0: from before them
    if (!std::isfinite(best_[i].cost)) return;
    const Patch patch = patch_at(x, y);
    Hypothesis best = best_[i];
    const double shift = std::sqrt(squared_parallax(x, y, best.plane, visible_[i]).mean());
    const auto attempt = [&](const PixelPlane& plane) {
      const float slope = std::abs(plane.wu - best.plane.wu) + std::abs(plane.wv - best.plane.wv);
      const float off = std::abs(plane.w - best.plane.w) + static_cast<float>(options_.patch.radius) * slope;
      if (off * shift < kSamePlane) return;
      const Hypothesis next = judge(patch, plane, i, best.cost);
      if (!(next.cost < best.cost)) return;
      best = next;
      best.since = now;
    };
    static constexpr int kNear[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    constexpr int reach = 5;
    for (int k = 0; k < (round == 0 ? 8 : 4); ++k) {
      const int far = k < 4 ? 1 : reach;
      const int dx = far * kNear[k & 3][0], dy = far * kNear[k & 3][1];
      if (x + dx < 0 || y + dy < 0 || x + dx >= width_ || y + dy >= height_) continue;
      const Hypothesis& other = best_[static_cast<std::size_t>(y + dy) * width_ + x + dx];
      if (!std::isfinite(other.cost)) continue;
      // What was no better two half rounds ago is no better now.
      if (k < 4 && round > 0 && other.since < now - 2) continue;
      attempt(
          {other.plane.at(static_cast<float>(-dx), static_cast<float>(-dy)), other.plane.wu, other.plane.wv});
    }
    PixelDice dice(options_.seed, i, round);
    const float sigma = sigma_w(i), slope = start_.planes[i].w / focal_;
    for (int k = 0; k < 2; ++k) {
      const float size = std::ldexp(1.0f, -round - k);
      PixelPlane plane = best.plane;
      plane.w += kFirstReach * sigma * size * dice.roll();
      plane.wu += 0.7f * slope * size * dice.roll();
      plane.wv += 0.7f * slope * size * dice.roll();
      attempt(plane);
    }
    best_[i] = best;
  }

  /// Of w, where the plane is: that of the Gaussian that pulls as the Student distribution does there.
  double prior_variance(const PixelPlane& plane, std::size_t i) const {
    const double sigma = sigma_w(i), off = (plane.w - start_.planes[i].w) / sigma;
    return sigma * sigma * std::max(1.0, (kFreedom + off * off) / (kFreedom + 1));
  }

  /// Normal equations of all agreeing views, and of the prior.
  struct Joint {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    double chi2 = 0;  ///< of the views' own opinions of the depth
    double chi2_last = 0;
    int views = 0;
  };

  Joint join(const Patch& patch, const PixelPlane& plane, std::uint32_t agreeing, std::size_t i) const {
    Joint joint;
    const double samples = kIndependentErrors * patch.sample_count();
    const double floor = options_.patch.noise * options_.patch.noise;
    double weights = 0, firsts = 0, seconds = 0;
    for (std::uint32_t left = agreeing; left != 0; left &= left - 1) {
      const Patch::Equations e = patch.linearise(sources_[std::countr_zero(left)], plane);
      if (!e.valid) continue;
      const double weight = samples / std::max(floor, e.residual);
      Eigen::Matrix3d a;
      a << e.a[0], e.a[1], e.a[2], e.a[1], e.a[3], e.a[4], e.a[2], e.a[4], e.a[5];
      joint.a += weight * a;
      joint.b += weight * Eigen::Vector3d(e.b[0], e.b[1], e.b[2]);
      ++joint.views;
      if (!(e.a[0] > 0)) continue;
      const double own = e.b[0] / e.a[0], w = weight * e.a[0];
      weights += w;
      firsts += w * own;
      seconds += w * own * own;
    }
    if (joint.views > 1 && weights > 0)
      joint.chi2 = (seconds - firsts * firsts / weights) / (joint.views - 1);
    const PixelPlane& start = start_.planes[i];
    const double slope = kSlopeSigma * start.w / focal_;
    const Eigen::Vector3d precision(1 / prior_variance(plane, i), 1 / (slope * slope), 1 / (slope * slope));
    joint.a.diagonal() += precision;
    joint.b +=
        precision.cwiseProduct(Eigen::Vector3d(start.w - plane.w, start.wu - plane.wu, start.wv - plane.wv));
    return joint;
  }

  /// Squares of how far points move in views, in pixels for a change of w by 1.
  struct Parallax {
    double squares = 0;
    int count = 0;
    double mean() const { return count > 0 ? squares / count : 0; }
  };

  Parallax squared_parallax(int x, int y, const PixelPlane& plane, std::uint32_t views) const {
    Parallax sum;
    for (std::uint32_t left = views; left != 0; left &= left - 1, ++sum.count) {
      const PatchWarp& warp = sources_[std::countr_zero(left)].warp;
      const Eigen::Vector3d& m = warp.parallax;
      const Eigen::Vector3d h = warp.from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1) + plane.w * m;
      sum.squares += (m.head<2>() - h.head<2>() / h.z() * m.z()).squaredNorm() / (h.z() * h.z());
    }
    return sum;
  }

  /// Of w, where points are off by pixel_sigma in each view.
  double calibration_variance(int x, int y, const PixelPlane& plane, std::uint32_t agreeing) const {
    const double mean = squared_parallax(x, y, plane, agreeing).mean();
    return mean > 0 ? options_.pixel_sigma * options_.pixel_sigma / mean : 0;
  }

  void finish(int x, int y, std::size_t i, RefinedView& out) const {
    Hypothesis best = best_[i];
    const double prior = static_cast<double>(sigma_w(i)) * sigma_w(i);
    double variance = prior, shared = prior;
    std::optional<Patch> patch;
    Joint joint;
    bool linearised = false;  // joint is that of the best plane
    if (std::isfinite(best.cost) && best.agreeing != 0) {
      patch.emplace(patch_at(x, y));
      const std::uint32_t agreeing = best.agreeing;
      PixelPlane plane = best.plane;
      for (int round = 0; round < kLeastSquaresRounds; ++round) {
        joint = join(*patch, plane, agreeing, i);
        const Eigen::Vector3d step = joint.a.ldlt().solve(joint.b);
        if (!step.allFinite()) break;
        const bool still = step[0] * step[0] * joint.a(0, 0) < kStill * kStill;
        plane.w += static_cast<float>(step[0]);
        plane.wu += static_cast<float>(step[1]);
        plane.wv += static_cast<float>(step[2]);
        if (still) {
          linearised = true;
          break;
        }
      }
      const Hypothesis polished = judge(*patch, plane, i);
      if (polished.cost <= best.cost * 1.02f + 0.1f) {
        linearised &= polished.agreeing == best.agreeing;
        best = polished;
      } else {
        linearised = false;
      }
    }
    if (best.agreeing != 0) {
      if (!patch) patch.emplace(patch_at(x, y));
      if (!linearised) joint = join(*patch, best.plane, best.agreeing, i);
      const std::uint32_t agreeing = best.agreeing;
      const double matched = joint.a.inverse()(0, 0);
      const double here = prior_variance(best.plane, i), from_volume = std::min(1.0, matched / here);
      const double calibration = calibration_variance(x, y, best.plane, agreeing);
      shared = std::min(here, kVolumeStretch * from_volume * matched) + calibration;
      variance = (1 - from_volume) * matched * std::max(1.0, joint.chi2) + shared;
      out.correlation.data()[i] = std::max(0.0f, best.correlation);
    }
    out.planes.planes[i] = best.plane;
    out.variance.data()[i] = static_cast<float>(variance);
    out.shared.data()[i] = static_cast<float>(shared);
  }

  const MatchView& view_;
  const PlaneMap& start_;
  const PatchMatchOptions& options_;
  const RunContext& context_;
  int width_, height_;
  float focal_;
  std::vector<const MatchView*> source_views_;
  std::vector<PatchSource> sources_;
  std::vector<Hypothesis> best_;
  std::vector<std::uint32_t> visible_;
};

}  // namespace

RefinedView refine_view(const MatchView& view, std::span<const MatchView* const> sources,
                        const PlaneMap& start, const PatchMatchOptions& options, const RunContext& context) {
  return ViewRefinement(view, sources, start, options, context).run();
}

}  // namespace roxel

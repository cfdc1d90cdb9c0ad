#include "roxel/depth/propagate_depth.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "roxel/base/error.h"
#include "roxel/base/median.h"

namespace roxel {
namespace {

/// Errors of a volume's depth are alike within a voxel: so many voxels' pixels count as one witness.
constexpr double kVoxelsAlike = 0.7;
constexpr double kGapVoxels = 0.3;         ///< roughness of the volume that is no gap
constexpr double kMedianToSigma = 1.4826;  ///< of a Gaussian's absolute values
constexpr float kLikeColor = 0.05f;        ///< difference of luma at which a tie is 1 / e^0.5 as strong
constexpr float kWeakestColor = 0.02f;
constexpr float kGapSigmas = 1;  ///< deviations at which a gap halves a tie's square root

/// Builds the lattice of one view.
class LatticeBuilder {
 public:
  LatticeBuilder(const DepthLayers& layers, const PropagationGuide& guide,
                 const PropagateDepthOptions& options)
      : layers_(layers),
        guide_(guide),
        options_(options),
        depth_(believed_depth(layers)),
        width_(depth_.width()),
        height_(depth_.height()),
        field_(width_, height_) {}

  GaussianLattice build() {
    if (aware()) add_steps();
    sigma_ = options_.prior_sigma.value_or(sigma_from_data());
    for (std::size_t i = 0; i < field_.mean.size(); ++i) {
      if (!(depth_.data()[i] > 0)) continue;
      field_.mean[i] = depth_.data()[i];
      field_.precision[i] = 1 / (variance_at(i) * alike(depth_.data()[i]));
    }
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width_ + x;
        if (x + 1 < width_) field_.right[i] = tie(i, i + 1, step(field_.right_step, i));
        if (y + 1 < height_) field_.down[i] = tie(i, i + width_, step(field_.down_step, i));
      }
    return std::move(field_);
  }
  double sigma() const { return sigma_; }

  /// Whether a pixel has depth or may be given some.
  bool takes_part(std::size_t i) const {
    if (depth_.data()[i] > 0) return true;
    if (!options_.fill) return false;
    return guide_.fillable.empty() ? layers_.opacity.data()[i] >= kEmptyRay : guide_.fillable.data()[i] > 0;
  }

 private:
  bool aware() const { return options_.prior == DepthPrior::kEdgeAware; }
  static float step(const std::vector<float>& steps, std::size_t i) { return steps.empty() ? 0 : steps[i]; }
  float variance_at(std::size_t i) const {
    const float z = depth_.data()[i];
    return std::max(layers_.variance.data()[i], 1e-12f * z * z);
  }

  /// Pixels that share one error.
  float alike(float z) const {
    if (!aware()) return 1;
    const double side = kVoxelsAlike * guide_.voxel_size * guide_.focal_px / z;
    return static_cast<float>(std::max(1.0, side * side));
  }

  /// How depth changes from a pixel to the next on the plane through its neighbourhood: mean of what the two
  /// say.
  void add_steps() {
    const PlaneMap planes = fit_planes(depth_, layers_.variance, guide_.focal_px,
                                       plane_radius(depth_, guide_.focal_px, guide_.voxel_size));
    field_.right_step.assign(field_.mean.size(), 0);
    field_.down_step.assign(field_.mean.size(), 0);
    const auto between = [&](std::size_t a, std::size_t b, float du, float dv) -> float {
      const PixelPlane &p = planes.planes[a], &q = planes.planes[b];
      if (p.empty() || q.empty()) return 0;
      const float ahead = p.at(du, dv), behind = q.at(-du, -dv);
      if (!(ahead > 0.5f * p.w) || !(behind > 0.5f * q.w)) return 0;
      return 0.5f * (1 / ahead - 1 / p.w + 1 / q.w - 1 / behind);
    };
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width_ + x;
        if (x + 1 < width_) field_.right_step[i] = between(i, i + 1, 1, 0);
        if (y + 1 < height_) field_.down_step[i] = between(i, i + width_, 0, 1);
      }
  }

  /// Median of what neighbours differ by, against what the prior expects, as a deviation.
  double sigma_from_data() const {
    std::vector<float> differences;
    double depth_sum = 0;
    const auto add = [&](std::size_t a, std::size_t b, float expected) {
      const float za = depth_.data()[a], zb = depth_.data()[b];
      if (!(za > 0) || !(zb > 0)) return;
      differences.push_back(std::abs(zb - za - expected));
      depth_sum += za;
    };
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width_ + x;
        if (x + 1 < width_) add(i, i + 1, step(field_.right_step, i));
        if (y + 1 < height_) add(i, i + width_, step(field_.down_step, i));
      }
    if (differences.empty()) return 1;
    return std::max(kMedianToSigma * median(differences),
                    1e-5 * depth_sum / static_cast<double>(differences.size()));
  }

  float tie(std::size_t a, std::size_t b, float expected) const {
    const float za = depth_.data()[a], zb = depth_.data()[b];
    const bool both = za > 0 && zb > 0;
    if (!takes_part(a) || !takes_part(b)) return 0;
    const float precision = static_cast<float>(1 / (sigma_ * sigma_));
    if (!aware()) return precision;
    const float la = guide_.luma.data()[a], lb = guide_.luma.data()[b];
    const float off = (la - lb) / kLikeColor;
    const float color =
        std::isfinite(off) ? std::max(kWeakestColor, std::exp(-0.5f * off * off)) : kWeakestColor;
    if (!both) return precision * color;
    const float gap = zb - za - expected;
    const float spread = static_cast<float>(
        kGapSigmas * kGapSigmas *
        (sigma_ * sigma_ + kGapVoxels * kGapVoxels * guide_.voxel_size * guide_.voxel_size));
    const float robust = 1 / (1 + gap * gap / spread);
    return precision * color * robust * robust;
  }

  const DepthLayers& layers_;
  const PropagationGuide& guide_;
  const PropagateDepthOptions& options_;
  Image depth_;
  int width_, height_;
  GaussianLattice field_;
  double sigma_ = 0;
};

}  // namespace

void PropagationFigures::add(const PropagationFigures& other) {
  pixels += other.pixels;
  filled += other.filled;
  variance_before += other.variance_before;
  variance_after += other.variance_after;
  prior_sigma += other.prior_sigma;
  views += other.views;
  sweeps = std::max(sweeps, other.sweeps);
  converged += other.converged;
  movement = std::max(movement, other.movement);
  seconds += other.seconds;
}

int plane_radius(const Image& depth, double focal_px, double voxel_size) {
  std::vector<float> depths;
  for (const float z : depth.data())
    if (z > 0) depths.push_back(z);
  if (depths.empty()) return 2;
  return static_cast<int>(std::clamp(std::lround(1.5 * voxel_size * focal_px / median(depths)), 2l, 6l));
}

PropagationFigures propagate_depth(DepthLayers& layers, const PropagationGuide& guide,
                                   const PropagateDepthOptions& options, const std::function<void()>& stop) {
  ROXEL_CHECK_EQ(guide.luma.width(), layers.depth.width());
  ROXEL_CHECK_EQ(guide.luma.height(), layers.depth.height());
  LatticeBuilder builder(layers, guide, options);
  const GaussianLattice field = builder.build();
  const auto start = std::chrono::steady_clock::now();
  const LatticeBeliefs beliefs = propagate(field, options.propagation, stop);
  PropagationFigures figures;
  figures.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  figures.views = 1;
  figures.prior_sigma = builder.sigma();
  figures.sweeps = beliefs.sweeps;
  figures.movement = beliefs.movement;
  figures.converged = beliefs.movement <= options.propagation.tolerance;
  layers.depth_bp = Image(field.width, field.height, 1);
  layers.variance_bp = Image(field.width, field.height, 1);
  for (std::size_t i = 0; i < field.mean.size(); ++i) {
    const bool had = field.precision[i] > 0;
    if (!(beliefs.precision[i] > 0) || !(beliefs.mean[i] > 0) || !builder.takes_part(i)) continue;
    layers.depth_bp.data()[i] = beliefs.mean[i];
    const float variance = 1 / beliefs.precision[i];
    layers.variance_bp.data()[i] = had ? std::min(variance, layers.variance.data()[i]) : variance;
    figures.pixels += had;
    figures.filled += !had;
    if (!had) continue;
    figures.variance_before += layers.variance.data()[i];
    figures.variance_after += layers.variance_bp.data()[i];
  }
  return figures;
}

}  // namespace roxel

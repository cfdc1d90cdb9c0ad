#pragma once
/// Fits the all-weather sky to radiances, one channel at a time.

#include <Eigen/Core>
#include <vector>

#include "roxel/sky/perez.h"

namespace roxel {

/// Light from one direction.
struct SkySample {
  Eigen::Vector3d direction;                           ///< unit, above the horizon
  Eigen::Vector3d radiance = Eigen::Vector3d::Zero();  ///< above 0
  double weight = 1;
};

/// Which parameters of the shape are free.
enum class PerezFreedom {
  kScaleOnly,  ///< the start that fits best, as it is
  kGradation,  ///< a and b; nothing depends on the sun
  kFull,       ///< a to e
  kExponent,   ///< and h
};

/// Strength of the prior that sky fits use: as much as a relative error of 0.7 % at one of its deviations.
inline constexpr double kSkyPrior = 2e-5;

struct PerezFitOptions {
  PerezFreedom freedom = PerezFreedom::kFull;
  std::vector<PerezShape> starts;  ///< at least one; see published_starts
  double prior_strength = 0;       ///< holds the shape near what skies are like: matters where no sample is
  double loss_scale = 0.05;        ///< relative errors above it count less and less (Cauchy)
  int iterations = 60;             ///< of the refinement; each start gets half as many on fewer samples
  int most_samples = 4000;         ///< more are thinned out evenly
};

struct PerezFit {
  PerezChannel channel;
  double mean_error = 0;  ///< weighted mean of |model / seen - 1|
  int start = 0;          ///< that led here
};

/// Bounds of the fit: b, d <= 0, scale > 0, and wide limits for the rest. Deterministic. Throws
/// std::logic_error without samples or starts.
PerezFit fit_perez(const std::vector<SkySample>& samples, int channel, const Eigen::Vector3d& sun,
                   const PerezFitOptions& options);

/// The eight published skies for a sun, and CIE's standard overcast, uniform and clear skies [CIE03].
std::vector<PerezShape> published_starts(const Eigen::Vector3d& sun);

}  // namespace roxel

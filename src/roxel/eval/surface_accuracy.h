#pragma once
/// A reconstructed surface against the true one, as the field measures it: accuracy and completeness
/// [Seitz06], precision, recall and F-score [Knapitsch17] [Schoeps17]. docs/evaluation.md says what is
/// counted.

#include <optional>
#include <string>

#include "roxel/eval/surface_distance.h"

namespace roxel {

/// At one distance.
struct DistanceShares {
  double distance = 0;   ///< world units
  double precision = 0;  ///< share in [0, 1] of the estimate no farther than it from the truth
  double recall = 0;     ///< share of the truth no farther than it from the estimate
  double f_score = 0;    ///< harmonic mean of the two
};

struct SurfaceAccuracy {
  std::int64_t estimate_points = 0;
  std::int64_t truth_points = 0;
  double accuracy_90 = 0;    ///< distance that 90 % of the estimate is within; infinity without an estimate
  double mean_to_truth = 0;  ///< of the estimate's points; infinity without any, as is the median
  double median_to_truth = 0;
  double mean_to_estimate = 0;  ///< of the truth's points; infinity without an estimate
  double median_to_estimate = 0;
  std::vector<DistanceShares> shares;
  std::vector<DistanceShares> curve;  ///< for a plot: kCurveSteps steps up to the largest distance
  static constexpr int kCurveSteps = 40;
};

/// From distances that are known: of the estimate's points to the truth, and of the truth's to the estimate.
/// Shares of nothing are 0, its distances infinity: what found nothing is not perfect.
SurfaceAccuracy surface_accuracy(std::vector<double> to_truth, std::vector<double> to_estimate,
                                 const std::vector<double>& distances);

/// The q-quantile in [0, 1] by nearest rank; 0 of nothing. Reorders the values.
double quantile(std::vector<double>& values, double q);

}  // namespace roxel

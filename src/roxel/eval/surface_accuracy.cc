#include "roxel/eval/surface_accuracy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "roxel/base/error.h"

namespace roxel {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();  ///< distance of what is not there

double mean_distance(const std::vector<double>& distances) {
  return distances.empty() ? kNothing
                           : std::accumulate(distances.begin(), distances.end(), 0.0) /
                                 static_cast<double>(distances.size());
}

double distance_quantile(std::vector<double>& distances, double q) {
  return distances.empty() ? kNothing : quantile(distances, q);
}

double share_within(const std::vector<double>& values, double limit) {
  if (values.empty()) return 0;
  const auto count = std::count_if(values.begin(), values.end(), [&](double v) { return v <= limit; });
  return static_cast<double>(count) / static_cast<double>(values.size());
}

double harmonic_mean(double a, double b) { return a + b > 0 ? 2 * a * b / (a + b) : 0.0; }

}  // namespace

double quantile(std::vector<double>& values, double q) {
  if (values.empty()) return 0;
  const double rank = std::ceil(q * static_cast<double>(values.size())) - 1;
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(std::max(rank, 0.0));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

SurfaceAccuracy surface_accuracy(std::vector<double> to_truth, std::vector<double> to_estimate,
                                 const std::vector<double>& distances) {
  SurfaceAccuracy accuracy;
  accuracy.estimate_points = static_cast<std::int64_t>(to_truth.size());
  accuracy.truth_points = static_cast<std::int64_t>(to_estimate.size());
  const auto shares_within = [&](double distance) {
    const double precision = share_within(to_truth, distance), recall = share_within(to_estimate, distance);
    return DistanceShares{distance, precision, recall, harmonic_mean(precision, recall)};
  };
  for (const double distance : distances) accuracy.shares.push_back(shares_within(distance));
  const double largest = distances.empty() ? 0.0 : *std::max_element(distances.begin(), distances.end());
  for (int step = 0; step <= SurfaceAccuracy::kCurveSteps && largest > 0; ++step)
    accuracy.curve.push_back(shares_within(largest * step / SurfaceAccuracy::kCurveSteps));
  accuracy.mean_to_truth = mean_distance(to_truth);
  accuracy.mean_to_estimate = mean_distance(to_estimate);
  accuracy.median_to_truth = distance_quantile(to_truth, 0.5);
  accuracy.median_to_estimate = distance_quantile(to_estimate, 0.5);
  accuracy.accuracy_90 = distance_quantile(to_truth, 0.9);
  return accuracy;
}

}  // namespace roxel

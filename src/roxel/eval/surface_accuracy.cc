#include "roxel/eval/surface_accuracy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"

namespace roxel {
namespace {

double mean(const std::vector<double>& values) {
  return values.empty()
             ? 0.0
             : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double share_within(const std::vector<double>& values, double limit) {
  if (values.empty()) return 0;
  const auto count = std::count_if(values.begin(), values.end(), [&](double v) { return v <= limit; });
  return static_cast<double>(count) / static_cast<double>(values.size());
}

double harmonic_mean(double a, double b) { return a + b > 0 ? 2 * a * b / (a + b) : 0.0; }

}  // namespace

bool is_seen(const TrueView& view, const Eigen::Vector3d& x) {
  const Eigen::Vector3d uvz = view.camera.project(x);
  const int width = view.depth.width(), height = view.depth.height();
  if (!(uvz.z() > 0 && uvz.x() >= 0 && uvz.x() < width && uvz.y() >= 0 && uvz.y() < height)) return false;
  const int left = static_cast<int>(std::floor(uvz.x() - 0.5)),
            top = static_cast<int>(std::floor(uvz.y() - 0.5));
  float nearest = std::numeric_limits<float>::infinity(), farthest = 0;
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx) {
      const float z =
          *view.depth.pixel(std::clamp(left + dx, 0, width - 1), std::clamp(top + dy, 0, height - 1));
      if (!(z > 0)) continue;
      nearest = std::min(nearest, z);
      farthest = std::max(farthest, z);
    }
  return uvz.z() >= nearest * (1 - kDepthTolerance) && uvz.z() <= farthest * (1 + kDepthTolerance);
}

void count_sightings(const TrueView& view, std::span<const Eigen::Vector3d> points, int threads,
                     std::vector<int>& counts) {
  constexpr std::int64_t kGrain = 8192;
  counts.resize(points.size(), 0);
  parallel_for_blocks(static_cast<std::int64_t>(points.size()), kGrain, threads,
                      [&](std::int64_t begin, std::int64_t end, int) {
                        for (std::int64_t i = begin; i < end; ++i) counts[i] += is_seen(view, points[i]);
                      });
}

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
  accuracy.mean_to_truth = mean(to_truth);
  accuracy.mean_to_estimate = mean(to_estimate);
  accuracy.median_to_truth = quantile(to_truth, 0.5);
  accuracy.median_to_estimate = quantile(to_estimate, 0.5);
  accuracy.accuracy_90 = quantile(to_truth, 0.9);
  return accuracy;
}

}  // namespace roxel

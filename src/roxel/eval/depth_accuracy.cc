#include "roxel/eval/depth_accuracy.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "roxel/base/error.h"

namespace roxel {
namespace {

double share(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

void check(const EstimatedDepth& estimate, std::span<const float> truth,
           const DepthAccuracyOptions& options) {
  ROXEL_CHECK_EQ(estimate.depth.size(), truth.size());
  if (!estimate.variance.empty()) ROXEL_CHECK_EQ(estimate.variance.size(), truth.size());
  if (!estimate.opacity.empty()) ROXEL_CHECK_EQ(estimate.opacity.size(), truth.size());
  ROXEL_CHECK(options.voxel_size > 0);
  ROXEL_CHECK(!options.thresholds.empty());
  ROXEL_CHECK(std::is_sorted(options.thresholds.begin(), options.thresholds.end()));
}

/// Of |error| / sigma: no error is within any deviation, and any error is infinitely far beyond none.
std::size_t normalized_bin(double error, double sigma, std::size_t bins) {
  if (error == 0) return 0;
  const double last = static_cast<double>(bins - 1);
  const double bin = sigma > 0 ? std::ceil(error / sigma * DepthAccuracy::kBinsPerSigma) - 1 : last;
  return static_cast<std::size_t>(std::clamp(bin, 0.0, last));
}

std::size_t log_bin(double voxels) {
  constexpr int kBins = std::tuple_size_v<DepthAccuracy::LogBins>;
  if (!(voxels > 0)) return 0;
  const double bin = (std::log10(voxels) - DepthAccuracy::kLowestDecade) * DepthAccuracy::kBinsPerDecade;
  return static_cast<std::size_t>(std::clamp(bin, 0.0, kBins - 1.0));
}

/// The middle of the bin that the median falls into.
double median_of(const DepthAccuracy::LogBins& bins) {
  std::int64_t total = 0, count = 0;
  for (const std::int64_t n : bins) total += n;
  if (total == 0) return 0;
  std::size_t bin = 0;
  while (bin + 1 < bins.size() && 2 * (count + bins[bin]) < total) count += bins[bin++];
  return std::pow(
      10.0, DepthAccuracy::kLowestDecade + (static_cast<double>(bin) + 0.5) / DepthAccuracy::kBinsPerDecade);
}

double log_loss(double error, double sigma) {
  const double s = std::max(sigma, DepthAccuracy::kLeastSigmaVoxels);
  const double off = std::min(error / s, DepthAccuracy::kMostDeviations);
  return std::log(s * std::sqrt(2 * std::numbers::pi)) + 0.5 * off * off;
}

/// Errors are compared in doubles; a float depth carries 6e-8, far below any voxel. A sigma of NaN is not
/// known.
void count_found(DepthAccuracy& sums, double error_voxels, double sigma_voxels, double voxel_size) {
  ++sums.found_pixels;
  const double distance = std::abs(error_voxels);
  for (std::size_t i = 0; i < sums.thresholds.size(); ++i) sums.within[i] += distance <= sums.thresholds[i];
  for (std::size_t i = 0; i < sums.distances.size(); ++i)
    sums.within_distance[i] += distance * voxel_size <= sums.distances[i];
  if (distance <= DepthAccuracy::kBiasVoxels) {
    ++sums.bias_pixels;
    sums.signed_error_voxels += error_voxels;
  }
  ++sums.errors[log_bin(distance)];
  if (!(sigma_voxels >= 0)) return;
  ++sums.calibrated_pixels;
  ++sums.sigmas[log_bin(sigma_voxels)];
  sums.log_loss += log_loss(distance, sigma_voxels);
  ++sums.normalized_errors[normalized_bin(distance, sigma_voxels, sums.normalized_errors.size())];
}

std::string row(const std::string& name, const DepthAccuracy& a) {
  char cell[128];
  std::string out = "| " + name;
  std::snprintf(cell, sizeof cell, " | %lld", static_cast<long long>(a.true_pixels));
  out += cell;
  for (std::size_t i = 0; i < a.within.size(); ++i) {
    std::snprintf(cell, sizeof cell, " | %.2f", 100 * a.share_within(i));
    out += cell;
  }
  for (std::size_t i = 0; i < a.distances.size(); ++i) {
    std::snprintf(cell, sizeof cell, " | %.2f", 100 * a.share_within_distance(i));
    out += cell;
  }
  std::snprintf(cell, sizeof cell, " | %.2f | %.2f | %+.3f", 100 * a.share_found(), 100 * a.share_false(),
                a.bias_voxels());
  out += cell;
  for (int k = 1; k <= 3; ++k) {
    std::snprintf(cell, sizeof cell, " | %.1f", 100 * a.share_within_sigma(k));
    out += cell;
  }
  return out + " |\n";
}

}  // namespace

double DepthAccuracy::share_within(std::size_t i) const { return share(within.at(i), true_pixels); }
double DepthAccuracy::share_within_distance(std::size_t i) const {
  return share(within_distance.at(i), true_pixels);
}
double DepthAccuracy::share_found() const { return share(found_pixels, true_pixels); }
double DepthAccuracy::share_false() const { return share(false_pixels, empty_pixels); }

double DepthAccuracy::bias_voxels() const {
  return bias_pixels > 0 ? signed_error_voxels / static_cast<double>(bias_pixels) : 0.0;
}

double DepthAccuracy::share_within_sigma(double k) const {
  const auto bins =
      std::clamp<std::int64_t>(std::llround(k * kBinsPerSigma), 0, normalized_errors.size() - 1);
  std::int64_t count = 0;
  for (std::int64_t i = 0; i < bins; ++i) count += normalized_errors[i];
  return share(count, calibrated_pixels);
}

double DepthAccuracy::median_normalized_error() const {
  if (calibrated_pixels == 0) return 0;
  std::int64_t count = 0;
  std::size_t bin = 0;
  while (bin + 1 < normalized_errors.size() && 2 * (count + normalized_errors[bin]) < calibrated_pixels)
    count += normalized_errors[bin++];
  return (static_cast<double>(bin) + 0.5) / kBinsPerSigma;
}

double DepthAccuracy::median_error_voxels() const { return median_of(errors); }
double DepthAccuracy::median_sigma_voxels() const { return median_of(sigmas); }
double DepthAccuracy::mean_log_loss() const {
  return calibrated_pixels > 0 ? log_loss / static_cast<double>(calibrated_pixels) : 0.0;
}

void DepthAccuracy::add(const DepthAccuracy& other) {
  ROXEL_CHECK(thresholds == other.thresholds);
  ROXEL_CHECK(distances == other.distances);
  true_pixels += other.true_pixels;
  found_pixels += other.found_pixels;
  empty_pixels += other.empty_pixels;
  false_pixels += other.false_pixels;
  signed_error_voxels += other.signed_error_voxels;
  calibrated_pixels += other.calibrated_pixels;
  for (std::size_t i = 0; i < within.size(); ++i) within[i] += other.within[i];
  for (std::size_t i = 0; i < distances.size(); ++i) within_distance[i] += other.within_distance[i];
  bias_pixels += other.bias_pixels;
  log_loss += other.log_loss;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    errors[i] += other.errors[i];
    sigmas[i] += other.sigmas[i];
  }
  for (std::size_t i = 0; i < normalized_errors.size(); ++i)
    normalized_errors[i] += other.normalized_errors[i];
}

DepthAccuracy depth_accuracy(const EstimatedDepth& estimate, std::span<const float> truth,
                             const DepthAccuracyOptions& options) {
  check(estimate, truth, options);
  DepthAccuracy sums;
  sums.thresholds = options.thresholds;
  sums.within.assign(options.thresholds.size(), 0);
  sums.distances = options.distances;
  sums.within_distance.assign(options.distances.size(), 0);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const float z = estimate.depth[i];
    const float opacity = estimate.opacity.empty() ? 1.0f : estimate.opacity[i];
    const bool has_depth = opacity > options.opacity_threshold && z > 0 && std::isfinite(z);
    if (truth[i] == 0) {
      ++sums.empty_pixels;
      sums.false_pixels += has_depth;
    } else if (truth[i] > 0 && std::isfinite(truth[i])) {
      ++sums.true_pixels;
      if (!has_depth) continue;
      const double variance = estimate.variance.empty() ? NAN : estimate.variance[i];
      const double sigma = variance >= 0 ? std::sqrt(variance) : NAN;
      count_found(sums, (static_cast<double>(z) - truth[i]) / options.voxel_size, sigma / options.voxel_size,
                  options.voxel_size);
    }
  }
  return sums;
}

std::string depth_methods_table(const std::vector<NamedDepthAccuracy>& methods) {
  if (methods.empty()) return "";
  char cell[128];
  std::string head = "| depth", rule = "|---", rows;
  for (const double threshold : methods.front().accuracy.thresholds) {
    std::snprintf(cell, sizeof cell, " | within %g %%", threshold);
    head += cell;
    rule += "|---:";
  }
  for (const auto& [name, a] : methods) {
    rows += "| " + name;
    for (std::size_t i = 0; i < a.thresholds.size(); ++i) {
      std::snprintf(cell, sizeof cell, " | %.2f", 100 * a.share_within(i));
      rows += cell;
    }
    std::snprintf(cell, sizeof cell, " | %.2f | %+.3f | %.4f | %.1f | %.1f | %.4f | %.3f |\n",
                  100 * a.share_found(), a.bias_voxels(), a.median_error_voxels(),
                  100 * a.share_within_sigma(1), 100 * a.share_within_sigma(1.96), a.median_sigma_voxels(),
                  a.mean_log_loss());
    rows += cell;
  }
  return head +
         " | with depth % | bias | median error | in 68 % interval | in 95 % interval | median sigma | log "
         "loss |\n" +
         rule + "|---:|---:|---:|---:|---:|---:|---:|\n" + rows;
}

std::string depth_accuracy_table(const std::vector<NamedDepthAccuracy>& views, std::size_t most_views) {
  if (views.empty()) return "";
  char cell[64];
  std::string head = "| view | pixels", rule = "|---|---:";
  DepthAccuracy all = views.front().accuracy;
  for (double threshold : all.thresholds) {
    std::snprintf(cell, sizeof cell, " | within %g %%", threshold);
    head += cell;
    rule += "|---:";
  }
  for (double distance : all.distances) {
    std::snprintf(cell, sizeof cell, " | within %g units %%", distance);
    head += cell;
    rule += "|---:";
  }
  std::string out = head + " | with depth % | empty given depth % | bias | in 1 sigma % | 2 | 3 |\n" + rule +
                    "|---:|---:|---:|---:|---:|---:|\n";
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (i > 0) all.add(views[i].accuracy);
    if (views.size() <= most_views) out += row(views[i].name, views[i].accuracy);
  }
  return out + row("**all**", all);
}

}  // namespace roxel

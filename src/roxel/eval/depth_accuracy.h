#pragma once
/// Depth maps against true depth: how many pixels are right, how many hallucinate a surface where there is
/// none, and whether the stated variances are honest. Planes are row-major floats of one size; depth is along
/// the optical axis, in world units, 0 = none.

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace roxel {

/// What a reconstruction says of one view.
struct EstimatedDepth {
  std::span<const float> depth;
  std::span<const float> variance;  ///< of the depth, world units squared; empty = no calibration figures
  std::span<const float> opacity;   ///< of the ray, in [0, 1]; empty = 1 everywhere
};

struct DepthAccuracyOptions {
  double voxel_size = 1;                               ///< world units; the unit of errors and thresholds
  std::vector<double> thresholds = {0.5, 1, 2, 4, 8};  ///< in voxels, ascending
  std::vector<double> distances = {};                  ///< further thresholds, in world units
  float opacity_threshold = 0.5f;                      ///< a pixel has depth where its opacity exceeds this
};

/// Counts over any number of views; add() joins them, so that shares are of all pixels together.
///
/// A pixel is true where the truth is > 0 and empty where it is 0; other true values (NaN, negative) leave
/// the pixel out. An estimate has depth where its opacity exceeds the threshold and its depth is finite and >
/// 0.
struct DepthAccuracy {
  std::vector<double> thresholds;  ///< in voxels
  std::int64_t true_pixels = 0;
  std::int64_t found_pixels = 0;              ///< true pixels that were given depth
  std::vector<std::int64_t> within;           ///< true pixels whose error is at most thresholds[i]
  std::vector<double> distances;              ///< in world units
  std::vector<std::int64_t> within_distance;  ///< true pixels whose error is at most distances[i]
  std::int64_t empty_pixels = 0;
  std::int64_t false_pixels = 0;            ///< empty pixels that were given depth
  static constexpr double kBiasVoxels = 4;  ///< outliers beyond would drown the bias
  std::int64_t bias_pixels = 0;             ///< found pixels within kBiasVoxels
  double signed_error_voxels = 0;           ///< summed over them
  std::int64_t calibrated_pixels = 0;       ///< found pixels with a variance >= 0
  /// Counts of |error| / sigma in bins of 1 / kBinsPerSigma; the last bin takes the rest, and errors where
  /// sigma is 0.
  static constexpr int kBinsPerSigma = 25;  ///< so that 1 and 1.96 are edges
  std::array<std::int64_t, 10 * kBinsPerSigma + 1> normalized_errors{};

  /// Sizes of errors and of deviations in voxels, in logarithmic bins; the first and last take the rest.
  static constexpr int kBinsPerDecade = 40;
  static constexpr int kLowestDecade = -5, kHighestDecade = 3;
  using LogBins = std::array<std::int64_t, (kHighestDecade - kLowestDecade) * kBinsPerDecade>;
  LogBins errors{};  ///< of found pixels
  LogBins sigmas{};  ///< of calibrated pixels
  /// Sum over calibrated pixels of log(sigma sqrt(2 pi)) + error^2 / 2 sigma^2, in voxels; sigma at least
  /// kLeastSigmaVoxels, error / sigma at most kMostDeviations, lest one pixel decide.
  double log_loss = 0;
  static constexpr double kLeastSigmaVoxels = 1e-4, kMostDeviations = 10;

  /// Share in [0, 1] of true pixels within thresholds[i]; a true pixel without depth counts as wrong.
  double share_within(std::size_t i) const;
  /// The same for distances[i].
  double share_within_distance(std::size_t i) const;
  /// Share in [0, 1] of true pixels that were given depth.
  double share_found() const;
  /// Share in [0, 1] of empty pixels that were given depth.
  double share_false() const;
  /// Mean of estimate minus truth in voxels, over the pixels within kBiasVoxels.
  double bias_voxels() const;
  /// Share in [0, 1] of calibrated pixels with |error| <= k sigma, k a multiple of 1 / kBinsPerSigma up to
  /// 10; honest Gaussian variances give 0.683, 0.954, 0.997 at k = 1, 2, 3.
  double share_within_sigma(double k) const;
  /// Median of |error| / sigma, to a bin; honest Gaussian variances give 0.674; above: overconfident.
  double median_normalized_error() const;

  /// Median over found pixels of |error|, in voxels, to 6 %.
  double median_error_voxels() const;
  /// Median over calibrated pixels of sigma, in voxels, to 6 %.
  double median_sigma_voxels() const;
  /// Mean negative log-likelihood of the errors in voxels under Gaussians of the stated deviations; less is
  /// better.
  double mean_log_loss() const;

  /// Both must have the same thresholds and distances.
  void add(const DepthAccuracy& other);
};

/// Throws std::logic_error where sizes differ or options are out of range. Every share of nothing is 0.
DepthAccuracy depth_accuracy(const EstimatedDepth& estimate, std::span<const float> truth,
                             const DepthAccuracyOptions& options);

/// One row of a table.
struct NamedDepthAccuracy {
  std::string name;
  DepthAccuracy accuracy;
};

/// A Markdown table, in percent: a row a view where those are at most `most_views`, and a last row "all" with
/// the sums.
std::string depth_accuracy_table(const std::vector<NamedDepthAccuracy>& views,
                                 std::size_t most_views = std::numeric_limits<std::size_t>::max());

/// The same pixels as several methods see them, a row each: shares within the thresholds, median error,
/// coverage, median sigma, log loss. Markdown.
std::string depth_methods_table(const std::vector<NamedDepthAccuracy>& methods);

}  // namespace roxel

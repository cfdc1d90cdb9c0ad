#include "roxel/eval/depth_accuracy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace roxel {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(DepthAccuracy, ByHand) {
  // Voxel 0.5: errors in voxels        0     +0.8   -3      +5    (no depth)(opaque too little)
  const std::vector<float> truth = {4, 4, 4, 4, 4, 4, 0, 0, 0};
  const std::vector<float> depth = {4, 4.4f, 2.5f, 6.5f, 0, 4, 0, 3, 3};
  const std::vector<float> opacity = {1, 1, 0.9f, 1, 1, 0.5f, 0, 0.9f, 0.4f};
  DepthAccuracyOptions options;
  options.voxel_size = 0.5;
  options.distances = {0.41, 2};
  const DepthAccuracy found = depth_accuracy({depth, {}, opacity}, truth, options);
  EXPECT_EQ(found.true_pixels, 6);
  EXPECT_EQ(found.found_pixels, 4);
  EXPECT_THAT(found.within, testing::ElementsAre(1, 2, 2, 3, 4));
  EXPECT_DOUBLE_EQ(found.share_within(3), 0.5);
  EXPECT_THAT(found.within_distance, testing::ElementsAre(2, 3));
  EXPECT_DOUBLE_EQ(found.share_within_distance(1), 0.5);
  EXPECT_DOUBLE_EQ(found.share_found(), 4 / 6.0);
  EXPECT_EQ(found.empty_pixels, 3);
  EXPECT_EQ(found.false_pixels, 1);
  EXPECT_DOUBLE_EQ(found.share_false(), 1 / 3.0);
  EXPECT_NEAR(found.bias_voxels(), (0 + 0.8 - 3) / 3, 1e-6);
  EXPECT_EQ(found.calibrated_pixels, 0);
}

TEST(DepthAccuracy, DepthThatIsNotANumberIsWrongAndUnknownTruthIsLeftOut) {
  const std::vector<float> truth = {2, 2, kNan, -1};
  const std::vector<float> depth = {kNan, std::numeric_limits<float>::infinity(), 2, 2};
  const DepthAccuracy found = depth_accuracy({depth, {}, {}}, truth, {});
  EXPECT_EQ(found.true_pixels, 2);
  EXPECT_EQ(found.found_pixels, 0);
  EXPECT_EQ(found.empty_pixels, 0);
}

TEST(DepthAccuracy, SharesOfNothingAreZero) {
  const DepthAccuracy none = depth_accuracy({}, {}, {});
  EXPECT_EQ(none.share_within(0), 0);
  EXPECT_EQ(none.share_false(), 0);
  EXPECT_EQ(none.bias_voxels(), 0);
  EXPECT_EQ(none.share_within_sigma(1), 0);
  EXPECT_EQ(none.median_normalized_error(), 0);
}

TEST(DepthAccuracy, MediansAndLogLossByHand) {
  // Voxel 0.5: errors 0.1, 0.2, 1 voxels; deviations 0.2, 0.2, 0.5.
  const std::vector<float> truth = {4, 4, 4, 4}, depth = {4.05f, 3.9f, 4.5f, 0};
  const std::vector<float> variance = {0.01f, 0.01f, 0.0625f, 1};
  DepthAccuracyOptions options;
  options.voxel_size = 0.5;
  const DepthAccuracy found = depth_accuracy({depth, variance, {}}, truth, options);
  EXPECT_NEAR(found.median_error_voxels(), 0.2, 0.2 * 0.06);
  EXPECT_NEAR(found.median_sigma_voxels(), 0.2, 0.2 * 0.06);
  const double by_hand =
      (2 * std::log(0.2) + std::log(0.5) + 3 * 0.5 * std::log(2 * M_PI) + 0.125 + 0.5 + 2) / 3;
  EXPECT_NEAR(found.mean_log_loss(), by_hand, 1e-5);
  DepthAccuracy twice = found;
  twice.add(found);
  EXPECT_NEAR(twice.mean_log_loss(), by_hand, 1e-5);
  EXPECT_EQ(twice.median_error_voxels(), found.median_error_voxels());
  const std::string table = depth_methods_table({{"volume", found}, {"refined", twice}});
  EXPECT_NE(table.find("| refined | 50.00 | 75.00 |"), std::string::npos) << table;
}

TEST(DepthAccuracy, LogLossPunishesTooLargeAndTooSmallDeviations) {
  const std::vector<float> truth(100, 4.0f);
  std::vector<float> depth;
  for (int i = 0; i < 100; ++i) depth.push_back(4 + (i % 2 ? 0.1f : -0.1f));
  const auto loss = [&](float sigma) {
    return depth_accuracy({depth, std::vector<float>(100, sigma * sigma), {}}, truth, {}).mean_log_loss();
  };
  EXPECT_LT(loss(0.1f), loss(0.05f));
  EXPECT_LT(loss(0.1f), loss(0.2f));
}

/// Gaussian errors of deviation `spread`, stated as deviation 0.1.
DepthAccuracy gaussian_errors(double spread) {
  const int count = 40000;
  std::mt19937 rng(5);
  std::normal_distribution<double> noise(0, spread);
  std::vector<float> truth(count, 10.0f), depth(count), variance(count, 0.01f);
  for (float& z : depth) z = float(10 + noise(rng));
  return depth_accuracy({depth, variance, {}}, truth, {});
}

TEST(DepthAccuracy, HonestVariancesHaveTheGaussianShares) {
  const DepthAccuracy honest = gaussian_errors(0.1);
  // Standard error of a share of 40000: at most 0.0025.
  EXPECT_NEAR(honest.share_within_sigma(1), 0.6827, 0.01);
  EXPECT_NEAR(honest.share_within_sigma(2), 0.9545, 0.01);
  EXPECT_NEAR(honest.share_within_sigma(3), 0.9973, 0.003);
  EXPECT_NEAR(honest.median_normalized_error(), 0.674, 0.06);
}

TEST(DepthAccuracy, OverconfidenceShows) {
  const DepthAccuracy bold = gaussian_errors(0.2);
  EXPECT_NEAR(bold.share_within_sigma(1), 0.3829, 0.01);
  EXPECT_NEAR(bold.median_normalized_error(), 2 * 0.674, 0.06);
}

TEST(DepthAccuracy, NoVarianceIsInfinitelySure) {
  const std::vector<float> truth(5, 2.0f), depth = {2.1f, 2, 2.1f, 2.1f, 2.1f};
  const std::vector<float> variance = {0, 0, 0.01f, kNan, -1};
  const DepthAccuracy found = depth_accuracy({depth, variance, {}}, truth, {});
  EXPECT_EQ(found.found_pixels, 5);
  EXPECT_EQ(found.calibrated_pixels, 3);  // what is no variance says nothing
  EXPECT_EQ(found.normalized_errors.back(), 1);
  EXPECT_EQ(found.normalized_errors.front(), 1);
  EXPECT_DOUBLE_EQ(found.share_within_sigma(3), 2 / 3.0);
}

TEST(DepthAccuracy, ViewsAddUpToOne) {
  const std::vector<float> truth = {1, 2, 0, 4, 5, 0}, depth = {1, 2.7f, 1, 3, 0, 0}, variance(6, 0.25f);
  const auto part = [&](int begin, int count) {
    const auto cut = [&](const std::vector<float>& v) { return std::span(v).subspan(begin, count); };
    return depth_accuracy({cut(depth), cut(variance), {}}, cut(truth), {});
  };
  DepthAccuracy joined = part(0, 2);
  joined.add(part(2, 4));
  const DepthAccuracy whole = part(0, 6);
  EXPECT_EQ(joined.true_pixels, whole.true_pixels);
  EXPECT_EQ(joined.found_pixels, whole.found_pixels);
  EXPECT_EQ(joined.within, whole.within);
  EXPECT_EQ(joined.false_pixels, whole.false_pixels);
  EXPECT_EQ(joined.normalized_errors, whole.normalized_errors);
  EXPECT_NEAR(joined.bias_voxels(), whole.bias_voxels(), 1e-12);
  EXPECT_EQ(whole.calibrated_pixels, 3);
}

TEST(DepthAccuracy, TableHasARowAViewAndTheSum) {
  const std::vector<float> truth = {1, 1}, good = {1, 1}, bad = {9, 9};
  const std::string table = depth_accuracy_table(
      {{"a", depth_accuracy({good, {}, {}}, truth, {})}, {"b", depth_accuracy({bad, {}, {}}, truth, {})}});
  EXPECT_THAT(table, testing::HasSubstr("| a | 2 | 100.00 |"));
  EXPECT_THAT(table, testing::HasSubstr("| b | 2 | 0.00 |"));
  EXPECT_THAT(table,
              testing::HasSubstr(
                  "| **all** | 4 | 50.00 | 50.00 | 50.00 | 50.00 | 100.00 | 100.00 | 0.00 | +0.000 |"));
}

TEST(DepthAccuracy, RefusesPlanesOfDifferentSizes) {
  const std::vector<float> two(2, 1.0f), three(3, 1.0f);
  EXPECT_THROW(depth_accuracy({two, {}, {}}, three, {}), std::logic_error);
  EXPECT_THROW(depth_accuracy({two, three, {}}, two, {}), std::logic_error);
  EXPECT_THROW(depth_accuracy({two, {}, three}, two, {}), std::logic_error);
  DepthAccuracyOptions options;
  options.voxel_size = 0;
  EXPECT_THROW(depth_accuracy({two, {}, {}}, two, options), std::logic_error);
}

}  // namespace
}  // namespace roxel

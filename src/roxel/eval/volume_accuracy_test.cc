#include "roxel/eval/volume_accuracy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace roxel {
namespace {

TEST(VolumeAccuracy, ByHand) {
  const std::vector<float> opacity{1.0f, 0.5f, 0.25f, 0.75f};
  const VolumeAccuracy found = volume_accuracy(opacity, {0, 2, 4, 30}, {0.2, 1, 1.1, 5, 0});
  EXPECT_EQ(found.voxels, 4);
  EXPECT_EQ(found.close_voxels, 3);
  EXPECT_DOUBLE_EQ(found.share_close(), 0.75);
  // Weights 1, 1/2 and 0.
  EXPECT_DOUBLE_EQ(found.weighted_mean_opacity(), (1 + 0.5 * 0.5) / 1.5);
  EXPECT_DOUBLE_EQ(found.share_covered(), 3 / 5.0);
}

TEST(VolumeAccuracy, HistogramByHand) {
  const VolumeAccuracy found =
      volume_accuracy({0.25f, 0.75f, 0.5f, 1.0f, 0.5f}, {0.1, 0.4, 0.5, 9.99, 10}, {});
  std::vector<std::int64_t> counts(found.histogram.voxels.begin(), found.histogram.voxels.end());
  std::vector<std::int64_t> expected(DistanceHistogram::kBins + 1, 0);
  expected[0] = 2;
  expected[1] = 1;
  expected[19] = 1;
  expected[20] = 1;
  EXPECT_EQ(counts, expected);
  EXPECT_DOUBLE_EQ(found.histogram.mean_opacity(0), 0.5);
  EXPECT_DOUBLE_EQ(found.histogram.mean_opacity(19), 1);
  EXPECT_EQ(found.histogram.mean_opacity(5), 0);
}

TEST(VolumeAccuracy, OfNothingIsZero) {
  const VolumeAccuracy none = volume_accuracy({}, {}, {});
  EXPECT_EQ(none.share_close(), 0);
  EXPECT_EQ(none.weighted_mean_opacity(), 0);
  EXPECT_EQ(none.share_covered(), 0);
}

TEST(VolumeAccuracy, WithoutVoxelsNothingIsCovered) {
  EXPECT_EQ(volume_accuracy({}, {}, {std::numeric_limits<double>::infinity()}).share_covered(), 0);
}

/// Three voxels of width 0.5 with opacities 0.9, 0.03 and 0.9; the last one nobody has looked at.
Volume three_voxels() {
  LatticeFrame frame;
  frame.voxel_size = 0.5;
  frame.size_in_bricks = {1, 1, 1};
  Topology topology(frame);
  for (const int i : {1, 2, 3}) topology.insert({i, 0, 7});
  Volume volume({topology});
  volume.tau = {tau_from_alpha(0.9f), tau_from_alpha(0.03f), tau_from_alpha(0.9f)};
  volume.confidence = {0.8f, 0.8f, 0.0f};
  return volume;
}

TEST(SavedVoxels, AreThoseAboveBothThresholds) {
  const SavedVoxels saved = saved_voxels(three_voxels(), 0.04f, 0.001f);
  ASSERT_EQ(saved.centres.size(), 1);
  EXPECT_EQ(saved.centres[0], Eigen::Vector3d(0.75, 0.25, 3.75));
  EXPECT_NEAR(saved.opacity[0], 0.9, 1e-6);
  EXPECT_EQ(saved_voxels(three_voxels(), 0.0f, 0.0f).centres.size(), 3);
}

}  // namespace
}  // namespace roxel

// How often one image updates a voxel ([Jethwa04] figure 5.4): once or twice with adaptive samples and ray
// weights, far more often near the camera without them.
#include <gtest/gtest.h>

#include <algorithm>

#include "roxel/infer/update_fixture.h"

namespace roxel {
namespace {

using fixture::Tunnel;
using fixture::UpdateCounter;

double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * (values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Mean count over voxels between two depths.
double mean_between(const Tunnel& tunnel, const UpdateCounter& counter, double begin, double end) {
  double sum = 0;
  int voxels = 0;
  for (std::uint32_t slot = 0; slot < tunnel.volume().slot_count(); ++slot)
    if (tunnel.depth(slot) > begin && tunnel.depth(slot) < end) sum += counter.weighted[slot], ++voxels;
  return sum / voxels;
}

// A sample's diagonal is at most a voxel's side over 0.7, that is, its side about a voxel's where it is
// widest.
TEST(UpdatesPerVoxel, AreNearOneWithAdaptiveSamplesAndRayWeights) {
  const Tunnel tunnel;
  const SampleView view = tunnel.view(true, 0.7);
  ASSERT_EQ(view.plan.root_level - view.plan.finest_level, 3);
  const UpdateCounter counter(tunnel.volume(), view);
  EXPECT_GT(quantile(counter.weighted, 0.01), 0.4);
  EXPECT_GT(quantile(counter.weighted, 0.1), 0.6);
  EXPECT_NEAR(quantile(counter.weighted, 0.5), 1.2, 0.3);
  EXPECT_LT(quantile(counter.weighted, 0.9), 2.5);
  EXPECT_LT(quantile(counter.weighted, 1), 4);
}

TEST(UpdatesPerVoxel, WithoutAdaptiveSamplesNearVoxelsGetTheSquareOfTheDepthRatio) {
  const Tunnel tunnel;
  const UpdateCounter fixed(tunnel.volume(), tunnel.view(false, 0.7));
  const UpdateCounter adaptive(tunnel.volume(), tunnel.view(true, 0.7));
  // Depths 1.5 and 7: (7 / 1.5)^2 = 22.
  const double ratio = mean_between(tunnel, fixed, 1.4, 1.6) / mean_between(tunnel, fixed, 6.9, 7.1);
  EXPECT_NEAR(ratio, 22, 3);
  EXPECT_GT(quantile(fixed.weighted, 1), 50);
  // A division multiplies samples by four, so adaptive counts stay within that of each other.
  const double adaptive_ratio = mean_between(tunnel, adaptive, 1, 2) / mean_between(tunnel, adaptive, 6, 8);
  EXPECT_GT(adaptive_ratio, 0.25);
  EXPECT_LT(adaptive_ratio, 4);
  EXPECT_LT(3 * adaptive.steps, fixed.steps);
}

TEST(UpdatesPerVoxel, GrowWithTheSquareOfSamplesPerVoxel) {
  const Tunnel tunnel;
  const UpdateCounter one(tunnel.volume(), tunnel.view(true, 0.35));
  const UpdateCounter two(tunnel.volume(), tunnel.view(true, 0.7));
  double sums[2] = {0, 0};
  for (const double count : one.weighted) sums[0] += count;
  for (const double count : two.weighted) sums[1] += count;
  EXPECT_NEAR(sums[1] / sums[0], 4, 0.4);
}

TEST(UpdatesPerVoxel, AreWhatTheColourPassDoes) {
  const Tunnel tunnel;
  const SampleView view = tunnel.view(true, 0.7);
  const UpdateCounter counter(tunnel.volume(), view);
  const LatticeStack stack(tunnel.volume());
  NodeScratch scratch(stack, tunnel.volume().tau);
  const PassCounts counts = march_color(stack, {view}, {}, true, RunContext(1), scratch);
  EXPECT_GE(counts.steps, counter.steps);
  EXPECT_LE(counts.steps, counter.steps + counter.slivers);
  EXPECT_LT(counter.slivers, 0.03 * counter.steps);
}

}  // namespace
}  // namespace roxel

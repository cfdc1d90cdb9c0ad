#include "roxel/volume/refine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace roxel {
namespace {

std::vector<LatticeFrame> frames() {
  return nested_frames({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(32)}, 1, 1);
}

void paint(Volume& volume, std::uint32_t slot, float alpha) {
  volume.tau[slot] = tau_from_alpha(alpha);
  volume.confidence[slot] = 0.5f;
  volume.color_weight[slot] = 3.0f + slot;
  volume.color_mean[slot] = {1.0f + slot, 2, 3};
  volume.color_cov[slot] = PackedCovariance({1, 2, 3.0f + slot, 0.4f, 0.5f, 0.6f});
  volume.support[slot] = {7, 8};
}

// Two voxels far apart: the first opaque, the second nearly empty.
Volume two_voxels() {
  Topology box(frames()[0]), surround(frames()[1]);
  box.insert({10, 10, 10});
  box.insert({20, 20, 20});
  Volume volume({box, surround});
  paint(volume, 0, 0.75f);
  paint(volume, 1, 0.005f);
  return volume;
}

TEST(Refine, DropsDilatesAndDivides) {
  const Volume next = refine(two_voxels(), {.opacity_threshold = 0.01f});
  EXPECT_EQ(next.slot_count(), 27u * 8);
  for (int k = 16; k < 24; ++k)
    for (int i = 16; i < 26; ++i)
      EXPECT_EQ(next.topology(0).contains({i, 20, k}), i >= 18 && i < 24 && k >= 18) << i << " " << k;
}

TEST(Refine, ChildrenInheritAndHalveTheDepth) {
  const Volume volume = two_voxels();
  const Volume next = refine(volume, {.opacity_threshold = 0.01f});
  for (int o = 0; o < 8; ++o) {
    const std::uint32_t s = next.index(0).slot({20 + (o & 1), 20 + (o >> 1 & 1), 20 + (o >> 2)});
    ASSERT_NE(s, kNoSlot);
    EXPECT_NEAR(alpha_from_tau(next.tau[s]), 1 - std::sqrt(1 - 0.75f), 1e-6);
    EXPECT_EQ(next.confidence[s], 0.5f);
    EXPECT_EQ(next.color_weight[s], volume.color_weight[0]);
    EXPECT_EQ(next.color_mean[s], volume.color_mean[0]);
    EXPECT_EQ(next.color_cov[s], volume.color_cov[0]);
    EXPECT_EQ(next.support[s], (std::array<float, 2>{0, 0}));
  }
}

TEST(Refine, NewVoxelsStartAtThePrior) {
  const Volume next = refine(two_voxels(), {.opacity_threshold = 0.01f, .prior_opacity = 0.03f});
  const std::uint32_t s = next.index(0).slot({19, 20, 20});
  ASSERT_NE(s, kNoSlot);
  EXPECT_FLOAT_EQ(alpha_from_tau(next.tau[s]), 0.03f);
  EXPECT_EQ(next.color_weight[s], 0.0f);
  EXPECT_EQ(next.confidence[s], 0.0f);
}

TEST(Refine, DividedVoxelsKeepAtLeastThePrior) {
  const Volume next = refine(two_voxels(), {.prior_opacity = 0.02f});
  const std::uint32_t s = next.index(0).slot({40, 40, 40});
  ASSERT_NE(s, kNoSlot);
  EXPECT_FLOAT_EQ(alpha_from_tau(next.tau[s]), 0.02f);
  EXPECT_EQ(next.color_mean[s][0], 2.0f);
}

TEST(Refine, VoxelsThatFailTheConfidenceThresholdGoAndStartAnewIfDilationPutsThemBack) {
  Topology box(frames()[0]);
  box.insert({10, 10, 10});
  box.insert({11, 10, 10});
  Volume volume({box});
  paint(volume, 0, 0.5f);
  paint(volume, 1, 0.5f);
  volume.confidence[1] = 0.1f;
  const Volume next = refine(volume, {.confidence_threshold = 0.3f, .subdivide = false});
  EXPECT_EQ(next.slot_count(), 27u);
  const std::uint32_t kept = next.index(0).slot({10, 10, 10}), again = next.index(0).slot({11, 10, 10});
  EXPECT_EQ(next.tau[kept], volume.tau[0]);
  EXPECT_EQ(next.support[kept], volume.support[0]);
  EXPECT_EQ(next.color_weight[again], 0.0f);
  EXPECT_FLOAT_EQ(alpha_from_tau(next.tau[again]), 0.02f);
}

TEST(Refine, SurroundStaysOutOfTheLatticeWithin) {
  Topology box(frames()[0]), surround(frames()[1]);
  surround.insert({7, 16, 16});  // touches the box, which covers voxels 8 to 23 of the surround
  const Volume next = refine(Volume({box, surround}), {});
  EXPECT_EQ(next.box_slot_count(), 0u);
  EXPECT_EQ(next.slot_count(), 2u * 3 * 3 * 8);
  EXPECT_FALSE(next.topology(1).contains({16, 32, 32}));
  EXPECT_TRUE(next.topology(1).contains({15, 32, 32}));
}

TEST(Refine, NeverDependsOnTheNumberOfThreads) {
  Topology box(frames()[0]);
  std::mt19937 random(1);
  for (int n = 0; n < 5000; ++n) box.insert(Eigen::Vector3i(random() % 32, random() % 32, random() % 32));
  Volume volume({box});
  for (std::uint32_t s = 0; s < volume.slot_count(); ++s) paint(volume, s, (random() % 1000) / 1000.0f);
  const Volume one = refine(volume, {.opacity_threshold = 0.5f}, 1);
  for (int threads : {2, 4}) {
    const Volume many = refine(volume, {.opacity_threshold = 0.5f}, threads);
    EXPECT_EQ(many.tau, one.tau);
    EXPECT_EQ(many.color_cov, one.color_cov);
    EXPECT_EQ(many.confidence, one.confidence);
  }
}

}  // namespace
}  // namespace roxel

#include "roxel/volume/volume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "roxel/base/error.h"

namespace roxel {
namespace {

Topology scattered_topology(const LatticeFrame& frame) {
  Topology topology(frame);
  const Eigen::Vector3i n = frame.size_in_voxels();
  for (int c : *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, n.prod())))
    topology.insert({c % n.x(), c / n.x() % n.y(), c / n.x() / n.y()});
  return topology;
}

RC_GTEST_PROP(BrickIndex, IsABijectionBetweenVoxelsAndOrderedSlots, ()) {
  const LatticeFrame frame{Eigen::Vector3d::Zero(), 1.0, Eigen::Vector3i(3, 2, 2)};
  const Topology topology = scattered_topology(frame);
  const std::uint32_t first = *rc::gen::inRange<std::uint32_t>(0, 1000);
  const BrickIndex index(topology, first);
  RC_ASSERT(index.slot_count() == topology.voxel_count());
  // Bricks x fastest, then voxels x fastest: with that walk, slots must simply count up.
  std::uint32_t next = first;
  for (int b = 0; b < frame.size_in_bricks.prod(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Eigen::Vector3i ijk(b % 3 * 8 + v % 8, b / 3 % 2 * 8 + v / 8 % 8, b / 6 * 8 + v / 64);
      RC_ASSERT(index.slot(ijk) == (topology.contains(ijk) ? next++ : kNoSlot));
    }
  RC_ASSERT(next == first + index.slot_count());
}

TEST(BrickIndex, HasNoSlotsOutsideTheFrame) {
  Topology topology({Eigen::Vector3d::Zero(), 1.0, Eigen::Vector3i(1, 1, 1)});
  topology.insert_brick({0, 0, 0}, BrickMask().set());
  const BrickIndex index(topology, 0);
  EXPECT_EQ(index.slot({7, 7, 7}), 511u);
  for (const Eigen::Vector3i& ijk : {Eigen::Vector3i(-1, 0, 0), {8, 0, 0}, {0, 8, 0}, {0, 0, -1}})
    EXPECT_EQ(index.slot(ijk), kNoSlot);
}

TEST(BrickIndex, BricksCountTheirVoxels) {
  Topology topology({Eigen::Vector3d::Zero(), 1.0, Eigen::Vector3i(2, 1, 1)});
  topology.insert({1, 0, 0});
  topology.insert({15, 7, 7});
  topology.insert({8, 0, 0});
  const BrickIndex index(topology, 5);
  ASSERT_EQ(index.bricks().size(), 2u);
  EXPECT_EQ(index.bricks()[0].count(), 1u);
  EXPECT_EQ(index.bricks()[1].count(), 2u);
  EXPECT_EQ(index.bricks()[1].first_slot, 6u);
  EXPECT_EQ(index.brick_at(1, 0, 0), 1);
  EXPECT_EQ(index.bricks()[1].slot(voxel_in_brick(7, 7, 7)), 7u);
}

TEST(LatticeFrame, VoxelCentresAreHalfAVoxelInside) {
  const LatticeFrame frame{Eigen::Vector3d(1, 2, 3), 0.5, Eigen::Vector3i(1, 2, 1)};
  EXPECT_TRUE(frame.voxel_centre({0, 0, 0}).isApprox(Eigen::Vector3d(1.25, 2.25, 3.25)));
  EXPECT_TRUE(frame.box().max().isApprox(Eigen::Vector3d(5, 10, 7)));
}

TEST(NestedFrames, GrowTheBoundsToWholeBricksAboutTheSameCentre) {
  const Eigen::AlignedBox3d bounds(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(2.6, 1.6, 0.01));
  const auto frames = nested_frames(bounds, 0.02, 0);
  ASSERT_EQ(frames.size(), 1u);
  // 130 voxels need 17 bricks; 80 are exactly ten, whatever 1.6 / 0.16 rounds to.
  EXPECT_EQ(frames[0].size_in_bricks, Eigen::Vector3i(17, 10, 1));
  EXPECT_TRUE(frames[0].box().center().isApprox(bounds.center(), 1e-12));
}

RC_GTEST_PROP(NestedFrames, NestOnVoxelAndBrickPlanes, ()) {
  const auto uniform = [](double lo, double hi) {
    return lo + (hi - lo) * *rc::gen::inRange(0, 1000000) / 1e6;
  };
  const Eigen::Vector3d corner(uniform(-50, 50), uniform(-50, 50), uniform(-50, 50));
  const Eigen::Vector3d extent(uniform(0.1, 30), uniform(0.1, 30), uniform(0.1, 30));
  const Eigen::AlignedBox3d bounds(corner, corner + extent);
  const auto frames = nested_frames(bounds, uniform(0.05, 2), 3);
  RC_ASSERT(frames.size() == 4u);
  RC_ASSERT(frames[0].box().contains(bounds.center()));
  const Eigen::Vector3d slack = frames[0].box().sizes() - bounds.sizes();
  RC_ASSERT((slack.array() > -1e-5 * frames[0].voxel_size).all());
  for (int k = 1; k < 4; ++k) {
    RC_ASSERT(frames[k].voxel_size == 2 * frames[k - 1].voxel_size);
    RC_ASSERT((frames[k].box().sizes() - 2 * frames[k - 1].box().sizes()).norm() < 1e-9);
    RC_ASSERT((frames[k].box().center() - bounds.center()).norm() < 1e-9);
    for (const Eigen::Vector3d& plane : {frames[k - 1].box().min(), frames[k - 1].box().max()}) {
      const Eigen::Array3d bricks = (plane - frames[k].origin) / (kBrickSide * frames[k].voxel_size);
      RC_ASSERT((bricks - bricks.round()).abs().maxCoeff() < 1e-9);
    }
  }
}

TEST(NestedFrames, SurroundWithoutTheLatticeWithinFillsTheShellExactly) {
  const auto frames = nested_frames({Eigen::Vector3d(0.1, 0.2, 0.3), Eigen::Vector3d(3, 4, 5)}, 0.1, 1);
  Topology shell(frames[1]);
  for (int b = 0; b < frames[1].size_in_bricks.prod(); ++b) {
    const Eigen::Vector3i n = frames[1].size_in_bricks;
    shell.insert_brick({b % n.x(), b / n.x() % n.y(), b / n.x() / n.y()}, BrickMask().set());
  }
  const std::int64_t all = shell.voxel_count();
  shell.erase_inside(frames[0].box());
  EXPECT_EQ(shell.voxel_count(), all - all / 8);
}

TEST(NestedFrames, RefusesNonsense) {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero(), one = Eigen::Vector3d::Ones();
  EXPECT_THROW(nested_frames({zero, one}, 0, 0), InvalidInput);
  EXPECT_THROW(nested_frames({zero, one}, std::nan(""), 0), InvalidInput);
  EXPECT_THROW(nested_frames({zero, zero}, 1, 0), InvalidInput);
  EXPECT_THROW(nested_frames({one, zero}, 1, 0), InvalidInput);
  EXPECT_THROW(nested_frames({zero, one * std::nan("")}, 1, 0), InvalidInput);
  EXPECT_THROW(nested_frames({zero, one}, 1e-9, 0), InvalidInput);
}

TEST(Volume, LatticesShareOneRangeOfSlots) {
  const auto frames = nested_frames({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}, 1.0 / 32, 1);
  Topology inner(frames[0]), outer(frames[1]);
  inner.insert({1, 2, 3});
  inner.insert({30, 2, 3});
  outer.insert({0, 0, 0});
  const Volume volume({inner, outer});
  EXPECT_EQ(volume.lattice_count(), 2);
  EXPECT_EQ(volume.slot_count(), 3u);
  EXPECT_EQ(volume.box_slot_count(), 2u);
  EXPECT_EQ(volume.index(1).first_slot(), 2u);
  EXPECT_EQ(volume.index(1).slot({0, 0, 0}), 2u);
  EXPECT_THAT(
      (std::vector<std::size_t>{volume.tau.size(), volume.confidence.size(), volume.color_weight.size(),
                                volume.color_mean.size(), volume.color_cov.size(), volume.support.size()}),
      testing::Each(3u));
}

TEST(Volume, NeverDependsOnTheNumberOfThreads) {
  Topology topology({Eigen::Vector3d::Zero(), 1.0, Eigen::Vector3i::Constant(10)});
  std::mt19937 random(3);
  for (int n = 0; n < 20000; ++n)
    topology.insert(Eigen::Vector3i(random() % 80, random() % 80, random() % 80));
  const Volume one({topology, topology}, 1);
  ASSERT_GT(one.index(0).bricks().size(), 900u);
  for (const int threads : {2, 4}) {
    const Volume many({topology, topology}, threads);
    ASSERT_EQ(many.slot_count(), one.slot_count());
    EXPECT_EQ(many.color_cov.size(), one.color_cov.size());
    for (const int k : {0, 1})
      for (std::size_t b = 0; b < one.index(k).bricks().size(); ++b) {
        const Brick &brick = many.index(k).bricks()[b], &expected = one.index(k).bricks()[b];
        ASSERT_EQ(brick.coord, expected.coord);
        ASSERT_EQ(brick.first_slot, expected.first_slot);
        ASSERT_TRUE(brick.word == expected.word && brick.before == expected.before);
      }
  }
}

TEST(Volume, IsEmptyByDefault) {
  EXPECT_EQ(Volume().slot_count(), 0u);
  EXPECT_EQ(Volume().box_slot_count(), 0u);
}

TEST(OpticalDepth, MatchesItsFormulaAlsoWhereOpacityIsTiny) {
  for (double tau : {1e-30, 1e-12, 1e-6, 0.01, 0.5, 3.0, 10.0}) {
    const double alpha = -std::expm1(-tau);
    EXPECT_NEAR(alpha_from_tau(tau) / alpha, 1.0, 3e-7) << tau;
    EXPECT_NEAR(tau_from_alpha(alpha) / -std::log1p(-static_cast<double>(static_cast<float>(alpha))), 1.0,
                3e-7);
  }
}

TEST(OpticalDepth, StaysFiniteAtItsEnds) {
  EXPECT_EQ(alpha_from_tau(0), 0.0f);
  EXPECT_EQ(tau_from_alpha(0), 0.0f);
  for (float tau : {16.0f, 100.0f, INFINITY}) EXPECT_LT(alpha_from_tau(tau), 1.0f);
  for (float alpha : {0.9999999f, 1.0f, 2.0f}) EXPECT_LE(tau_from_alpha(alpha), 16.0f);
  EXPECT_EQ(tau_from_alpha(1.0f), 16.0f);
  EXPECT_EQ(tau_from_alpha(-0.1f), 0.0f);
}

}  // namespace
}  // namespace roxel

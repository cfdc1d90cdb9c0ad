#include "roxel/march/packet_walk.h"

#include <gtest/gtest.h>

#include <limits>

#include "roxel/march/walk_fixture.h"

namespace roxel {
namespace {

struct RangedRay {
  Ray ray;
  Stretch range;
};

/// The steps of every ray, each in the lane of its number.
std::vector<std::vector<VoxelStep>> walked(const LatticeStack& stack, const std::vector<RangedRay>& rays) {
  PacketWalk walk(stack);
  for (std::size_t lane = 0; lane < rays.size(); ++lane)
    walk.begin(static_cast<int>(lane), rays[lane].ray, rays[lane].range, nullptr);
  std::vector<std::vector<VoxelStep>> steps(kLanes);
  StepRows rows;
  while (walk.next(rows))
    for (int lane = 0; lane < kLanes; ++lane)
      for (int row = 0; row < rows.count[lane]; ++row)
        steps[lane].push_back({rows.slot[row][lane], rows.length[row][lane], rows.weight[row][lane],
                               std::numeric_limits<float>::quiet_NaN()});
  return steps;
}

::testing::AssertionResult same_walks(const LatticeStack& stack, const std::vector<RangedRay>& rays) {
  std::vector<std::vector<VoxelStep>> steps = walked(stack, rays);
  for (std::size_t lane = 0; lane < rays.size(); ++lane) {
    std::erase_if(steps[lane], [](const VoxelStep& step) { return step.length < kSliver; });
    const auto same = same_as_twin(stack.volume(), rays[lane].ray, rays[lane].range, steps[lane]);
    if (!same) return ::testing::AssertionFailure() << "lane " << lane << ": " << same.message();
  }
  for (std::size_t lane = rays.size(); lane < kLanes; ++lane)
    if (!steps[lane].empty()) return ::testing::AssertionFailure() << "steps in idle lane " << lane;
  return ::testing::AssertionSuccess();
}

TEST(PacketWalk, MeetsWhatSortedPlaneCrossingsMeet) {
  std::mt19937 random(1);
  const Volume volume = one_lattice(0.5, {3, 2, 2}, random);
  const LatticeStack stack(volume);
  RandomRays rays(volume.index(0).frame().box(), 2);
  for (int i = 0; i < 4000; ++i) {
    std::vector<RangedRay> packet;
    for (int lane = 0; lane < i % (kLanes + 1); ++lane)
      packet.push_back({rays.any(), i % 2 ? rays.range() : Stretch{0, 20}});
    ASSERT_TRUE(same_walks(stack, packet));
  }
}

TEST(PacketWalk, PassesExactlyThroughFacesEdgesAndCorners) {
  std::mt19937 random(5);
  const Volume volume = one_lattice(0.6, {2, 2, 2}, random);
  const LatticeStack stack(volume);
  for (int i = 0; i < 4000; ++i) {
    std::vector<RangedRay> packet;
    for (int lane = 0; lane < kLanes; ++lane)
      packet.push_back({ray_with_ties(volume.index(0).frame(), i % 3, random), {0, 30}});
    ASSERT_TRUE(same_walks(stack, packet));
  }
}

TEST(PacketWalk, GoesThroughNestedLatticesInwardsAndOut) {
  std::mt19937 random(6);
  const Volume volume = nested(0.5, 2, random);
  const LatticeStack stack(volume);
  RandomRays rays(volume.index(1).frame().box(), 7);
  for (int i = 0; i < 800; ++i) {
    std::vector<RangedRay> packet;
    for (int lane = 0; lane < kLanes; ++lane)
      packet.push_back({rays.any(), lane % 2 ? rays.range() : Stretch{0, 30}});
    ASSERT_TRUE(same_walks(stack, packet));
  }
}

TEST(PacketWalk, StoppedLanesGiveNoMoreSteps) {
  std::mt19937 random(8);
  const Volume volume = one_lattice(1, {6, 1, 1}, random);
  const LatticeStack stack(volume);
  const Eigen::Vector3d from = volume.index(0).frame().voxel_centre({0, 3, 3});
  PacketWalk walk(stack);
  for (int lane = 0; lane < kLanes; ++lane) walk.begin(lane, {from, {1, 0.01, 0.02}}, {0, 20}, nullptr);
  StepRows rows;
  ASSERT_TRUE(walk.next(rows));
  EXPECT_GT(rows.count[3], 0);
  walk.stop(3);
  ASSERT_TRUE(walk.next(rows));
  EXPECT_EQ(rows.count[3], 0);
  EXPECT_GT(rows.count[2], 0);
}

// The flags cut each lane's steps into stretches of one brick each, and every such brick is listed.
TEST(PacketWalk, FlagsTheFirstStepInEachBrick) {
  std::mt19937 random(9);
  const Volume volume = one_lattice(0.5, {3, 3, 3}, random);
  const LatticeStack stack(volume);
  RandomRays rays(volume.index(0).frame().box(), 10);
  const auto brick_of = [&](std::uint32_t slot) {
    std::uint32_t number = 0;
    while (slot >= stack.brick(number).first_slot + stack.brick(number).count) ++number;
    return number;
  };
  for (int i = 0; i < 200; ++i) {
    PacketWalk walk(stack);
    for (int lane = 0; lane < kLanes; ++lane) walk.begin(lane, rays.any(), {0, 20}, nullptr);
    StepRows rows;
    std::vector<std::uint32_t> last(kLanes, kNoSlot);
    while (walk.next(rows))
      for (int lane = 0; lane < kLanes; ++lane)
        for (int row = 0; row < rows.count[lane]; ++row) {
          const std::uint32_t brick = brick_of(rows.slot[row][lane]);
          ASSERT_EQ(rows.begins[row] >> lane & 1, brick != last[lane]);
          ASSERT_NE(std::find(rows.bricks, rows.bricks + rows.brick_count, brick),
                    rows.bricks + rows.brick_count);
          last[lane] = brick;
        }
  }
}

// Rows are worked on whole: what fills the lanes up must be harmless.
TEST(PacketWalk, FillsUpWithOtherLanesSlotsAndNoLength) {
  std::mt19937 random(11);
  const Volume volume = one_lattice(0.5, {3, 3, 3}, random);
  const LatticeStack stack(volume);
  RandomRays rays(volume.index(0).frame().box(), 12);
  for (int i = 0; i < 200; ++i) {
    PacketWalk walk(stack);
    for (int lane = 0; lane < 1 + i % kLanes; ++lane) walk.begin(lane, rays.any(), {0, 20}, nullptr);
    StepRows rows;
    while (walk.next(rows))
      for (int row = 0; row < rows.rows; ++row)
        for (int lane = 0; lane < kLanes; ++lane) {
          ASSERT_LT(rows.slot[row][lane], volume.slot_count());
          if (row < rows.count[lane]) continue;
          ASSERT_EQ(rows.length[row][lane], 0);
          ASSERT_EQ(rows.weight[row][lane], 0);
          ASSERT_EQ(rows.begins[row] >> lane & 1, 0);
        }
  }
}

}  // namespace
}  // namespace roxel

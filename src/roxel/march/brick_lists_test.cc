#include "roxel/march/brick_lists.h"

#include <gtest/gtest.h>

#include <limits>

#include "roxel/march/packet_walk.h"
#include "roxel/march/walk_fixture.h"

namespace roxel {
namespace {

PinholeCamera camera_somewhere(double distance, std::mt19937& random) {
  std::normal_distribution<double> normal(0, 1);
  PinholeCamera camera;
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
  camera.pose.rotation = turn.toRotationMatrix();
  const Eigen::Vector3d aside(0.3 * normal(random), 0.3 * normal(random), 0);
  camera.pose.centre =
      -distance * camera.pose.rotation.row(2).transpose() + camera.pose.rotation.transpose() * aside;
  camera.intrinsics = {53, 37, 40, 42, 25, 19, 0.7};
  return camera;
}

/// Samples of 4 pixels to depth 2, of 2 to depth 4, of 1 behind.
SamplePlan plan_to(double far) {
  SamplePlan plan;
  plan.range = {0.01, far};
  plan.root_level = 2;
  plan.finest_level = 0;
  plan.serves_until_ = {0, 4, 2};
  return plan;
}

/// Counts the steps that packets find by the lists; fails where one ray's are not the twin's.
void expect_all_met(const Volume& volume, const PinholeCamera& camera, std::size_t& met) {
  const LatticeStack stack(volume);
  const SamplePlan plan = plan_to(30);
  const BrickLists lists(stack, camera, plan);
  PacketWalk walk(stack);
  PacketSteps steps;
  double begin = plan.range.begin;
  for (int level = plan.root_level; level >= plan.finest_level; --level) {
    const Stretch range{begin, std::min(plan.range.end, plan.serves_until(level))};
    begin = range.end;
    for (int y = 0; y << level < camera.intrinsics.height; ++y)
      for (int x = 0; x << level < camera.intrinsics.width; ++x) {
        const double side = std::ldexp(1, level);
        const Ray ray = camera.ray(std::min((x + 0.5) * side, 53.0), std::min((y + 0.5) * side, 37.0));
        walk.begin(ray.origin, range, lists.at(level, x, y));
        walk.add(0, ray.direction);
        std::vector<VoxelStep> found;
        while (walk.next(steps))
          for (int i = 0; i < steps.count; ++i)
            if (steps.length[i] >= kSliver)
              found.push_back(
                  {steps.slot[i], steps.length[i], steps.weight[i], std::numeric_limits<float>::quiet_NaN()});
        ASSERT_TRUE(same_as_twin(volume, ray, range, found));
        met += found.size();
      }
  }
}

class BrickListsTest : public testing::TestWithParam<double> {};

// From outside, from in between the lattices and from within: packets that go by the lists meet what single
// rays meet, in the same order, at the depths of each level.
TEST_P(BrickListsTest, PacketsMeetAllThatRaysMeet) {
  std::mt19937 random(3);
  std::size_t met = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const Volume volume = nested(0.4, 2, random);
    expect_all_met(volume, camera_somewhere(GetParam(), random), met);
  }
  EXPECT_GT(met, 10000u);
}

INSTANTIATE_TEST_SUITE_P(OutsideBetweenAndInside, BrickListsTest, testing::Values(9.0, 3.0, 1.4, 0.3));

// Centres on planes between bricks and on the boxes' faces, where a hair decides which side they are on.
TEST(BrickLists, CamerasOnPlanesSeeAll) {
  std::mt19937 random(4);
  const Volume volume = nested(0.4, 2, random);
  std::size_t met = 0;
  for (int k = 0; k < 3; ++k) {
    const LatticeFrame& frame = volume.index(k).frame();
    const double side = kBrickSide * frame.voxel_size;
    for (int corner = 0; corner <= frame.size_in_bricks.x(); ++corner) {
      PinholeCamera camera;
      camera.pose.centre = frame.origin + side * Eigen::Vector3d(corner, 1, corner);
      // Along an axis, and turned off it by little so that rays do not run within the planes.
      camera.pose.rotation =
          Eigen::AngleAxisd(0.5 * M_PI * (corner % 4) + 0.003, Eigen::Vector3d(0.01, 1, 0.02).normalized())
              .toRotationMatrix();
      camera.intrinsics = {53, 37, 40, 42, 25.3, 19.2, 0.7};
      expect_all_met(volume, camera, met);
    }
  }
  EXPECT_GT(met, 10000u);
}

TEST(BrickLists, LeaveOutWhatIsNotSeen) {
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {4, 1, 1}});
  topology.insert({1, 1, 1});
  topology.insert({25, 1, 1});
  const Volume volume({topology});
  PinholeCamera camera;
  camera.pose.centre = {4, 4, -20};
  camera.intrinsics = {200, 200, 200, 200, 100, 100, 0};
  SamplePlan plan;
  plan.range = {1, 100};
  plan.serves_until_ = {0};
  const BrickLists lists(LatticeStack(volume), camera, plan);
  ASSERT_EQ(lists.at(0, 100, 100).size(), 1u);
  EXPECT_EQ(lists.at(0, 100, 100)[0], 0u);
  EXPECT_TRUE(lists.at(0, 0, 0).empty());
  EXPECT_TRUE(lists.at(0, 199, 10).empty());
  EXPECT_EQ(lists.at(0, 97, 101).data(), lists.at(0, 100, 103).data());
  plan.range.end = 19;
  EXPECT_TRUE(BrickLists(LatticeStack(volume), camera, plan).at(0, 100, 100).empty());
}

/// Whether the sample or one that it divides into has a list with bricks.
bool can_meet(const BrickLists& lists, const PinholeCamera& camera, int level, int x, int y) {
  if (x << level >= camera.intrinsics.width || y << level >= camera.intrinsics.height) return false;
  if (!lists.at(level, x, y).empty()) return true;
  for (int c = 0; c < 4 && level > 0; ++c)
    if (can_meet(lists, camera, level - 1, 2 * x + (c & 1), 2 * y + (c >> 1))) return true;
  return false;
}

// A square has nothing from some level on if no list of a sample in it has anything, nor finer ones.
TEST(BrickLists, KnowWhereNothingCanBeMet) {
  Topology topology(LatticeFrame{{-8, -4, 0}, 0.5, {8, 2, 2}});
  topology.insert({30, 3, 3});
  topology.insert({60, 9, 12});
  const Volume volume({topology});
  int none = 0, some = 0;
  for (const double distance : {-1.0, -3.0, -6.0}) {
    PinholeCamera camera;
    camera.pose.centre = {-1, -2, distance};
    camera.intrinsics = {301, 203, 60, 60, 150, 100, 0};
    const SamplePlan plan = plan_to(30);
    const BrickLists lists(LatticeStack(volume), camera, plan);
    for (int level = 0; level <= 2; ++level)
      for (int y = 0; y << level < camera.intrinsics.height; y += BrickLists::kSide)
        for (int x = 0; x << level < camera.intrinsics.width; x += BrickLists::kSide) {
          bool any = false;
          for (int i = 0; i < BrickLists::kSide * BrickLists::kSide; ++i)
            any |= can_meet(lists, camera, level, x + i % BrickLists::kSide, y + i / BrickLists::kSide);
          ASSERT_EQ(lists.none_from(level, x, y), !any) << distance << ' ' << level << ' ' << x << ' ' << y;
          ++(any ? some : none);
        }
  }
  EXPECT_GT(none, 100);
  EXPECT_GT(some, 100);
}

}  // namespace
}  // namespace roxel

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <random>
#include <set>
#include <tuple>

#include "roxel/volume/volume.h"

namespace roxel {
namespace {

using Ijk = std::tuple<int, int, int>;

LatticeFrame small_frame() { return {Eigen::Vector3d(-1, 2, 0.5), 0.25, Eigen::Vector3i(2, 3, 4)}; }

std::set<Ijk> voxels(const Topology& topology) {
  std::set<Ijk> all;
  topology.for_each_brick([&](const Eigen::Vector3i& brick, const BrickMask& mask) {
    for (int k = 0; k < kBrickSide; ++k)
      for (int j = 0; j < kBrickSide; ++j)
        for (int i = 0; i < kBrickSide; ++i)
          if (mask[voxel_in_brick(i, j, k)])
            all.emplace(8 * brick.x() + i, 8 * brick.y() + j, 8 * brick.z() + k);
  });
  return all;
}

// Scattered voxels in the box, and now and then beside it.
std::set<Ijk> scatter(const LatticeFrame& frame, int margin) {
  const Eigen::Vector3i n = frame.size_in_voxels();
  return *rc::gen::container<std::set<Ijk>>(rc::gen::tuple(rc::gen::inRange(-margin, n.x() + margin),
                                                           rc::gen::inRange(-margin, n.y() + margin),
                                                           rc::gen::inRange(-margin, n.z() + margin)));
}

Topology topology_of(const LatticeFrame& frame, const std::set<Ijk>& ijks) {
  Topology topology(frame);
  for (const auto& [i, j, k] : ijks) topology.insert({i, j, k});
  return topology;
}

bool in_box(const LatticeFrame& frame, const Ijk& ijk) {
  const auto [i, j, k] = ijk;
  const Eigen::Vector3i n = frame.size_in_voxels();
  return i >= 0 && j >= 0 && k >= 0 && i < n.x() && j < n.y() && k < n.z();
}

RC_GTEST_PROP(Topology, HoldsWhatIsInsertedInsideTheBox, ()) {
  const LatticeFrame frame = small_frame();
  const std::set<Ijk> wanted = scatter(frame, 3);
  std::set<Ijk> inside;
  for (const Ijk& ijk : wanted)
    if (in_box(frame, ijk)) inside.insert(ijk);
  const Topology topology = topology_of(frame, wanted);
  RC_ASSERT(voxels(topology) == inside);
  RC_ASSERT(topology.voxel_count() == static_cast<std::int64_t>(inside.size()));
  for (const auto& [i, j, k] : wanted)
    RC_ASSERT(topology.contains({i, j, k}) == (inside.count({i, j, k}) > 0));
}

RC_GTEST_PROP(Topology, DilationAddsAllWithinTheStepsInsideTheBox, ()) {
  const LatticeFrame frame = small_frame();
  const std::set<Ijk> seeds = scatter(frame, 0);
  const int steps = *rc::gen::inRange(0, 4);
  std::set<Ijk> expected;
  for (const auto& [i, j, k] : seeds)
    for (int z = -steps; z <= steps; ++z)
      for (int y = -steps; y <= steps; ++y)
        for (int x = -steps; x <= steps; ++x)
          if (in_box(frame, {i + x, j + y, k + z})) expected.emplace(i + x, j + y, k + z);
  Topology topology = topology_of(frame, seeds);
  topology.dilate(steps);
  RC_ASSERT(voxels(topology) == expected);
}

RC_GTEST_PROP(Topology, SubdivisionDividesEachVoxelIntoEight, ()) {
  const LatticeFrame frame = small_frame();
  const std::set<Ijk> parents = scatter(frame, 0);
  const Topology children = topology_of(frame, parents).subdivided();
  std::set<Ijk> expected;
  for (const auto& [i, j, k] : parents)
    for (int o = 0; o < 8; ++o) expected.emplace(2 * i + (o & 1), 2 * j + (o >> 1 & 1), 2 * k + (o >> 2));
  RC_ASSERT(voxels(children) == expected);
  RC_ASSERT(children.frame().voxel_size == frame.voxel_size / 2);
  RC_ASSERT(children.frame().box().isApprox(frame.box()));
}

RC_GTEST_PROP(Topology, BrickMasksInsertAndErase, ()) {
  const LatticeFrame frame = small_frame();
  const std::set<Ijk> first = scatter(frame, 0), second = scatter(frame, 0);
  Topology topology = topology_of(frame, first);
  topology_of(frame, second).for_each_brick([&](const Eigen::Vector3i& brick, const BrickMask& mask) {
    topology.insert_brick(brick, mask);
  });
  std::set<Ijk> both = first;
  both.insert(second.begin(), second.end());
  RC_ASSERT(voxels(topology) == both);
  topology_of(frame, first).for_each_brick([&](const Eigen::Vector3i& brick, const BrickMask& mask) {
    topology.erase_brick(brick, mask);
  });
  for (const Ijk& ijk : first) both.erase(ijk);
  RC_ASSERT(voxels(topology) == both);
}

TEST(Topology, VisitsBricksXFastest) {
  Topology topology(small_frame());
  for (const Eigen::Vector3i& ijk : {Eigen::Vector3i(0, 0, 9), {9, 0, 0}, {0, 9, 0}, {0, 0, 0}, {9, 9, 9}})
    topology.insert(ijk);
  std::vector<Ijk> order;
  topology.for_each_brick(
      [&](const Eigen::Vector3i& b, const BrickMask&) { order.emplace_back(b.x(), b.y(), b.z()); });
  EXPECT_THAT(order,
              testing::ElementsAre(Ijk{0, 0, 0}, Ijk{1, 0, 0}, Ijk{0, 1, 0}, Ijk{0, 0, 1}, Ijk{1, 1, 1}));
}

TEST(Topology, DoesNotVisitBricksWhoseVoxelsAreAllErased) {
  Topology topology(small_frame());
  topology.insert({3, 4, 5});
  topology.erase_brick({0, 0, 0}, BrickMask().set());
  topology.for_each_brick([](const Eigen::Vector3i&, const BrickMask&) { FAIL(); });
  EXPECT_EQ(topology.voxel_count(), 0);
}

TEST(Topology, IgnoresBricksOutsideTheBox) {
  Topology topology(small_frame());
  topology.insert_brick({2, 0, 0}, BrickMask().set());
  topology.insert_brick({0, -1, 0}, BrickMask().set());
  topology.erase_brick({0, 0, 77}, BrickMask().set());
  EXPECT_EQ(topology.voxel_count(), 0);
}

// A full lattice: OpenVDB may keep uniform regions as tiles, which must not lose voxels.
TEST(Topology, FullLatticeStaysFullUnderDilation) {
  Topology topology({Eigen::Vector3d::Zero(), 1.0, Eigen::Vector3i(17, 16, 16)});
  topology.insert({68, 64, 64});
  topology.dilate(72);
  EXPECT_EQ(topology.voxel_count(), 136L * 128 * 128);
  EXPECT_EQ(voxels(topology).size(), 136u * 128 * 128);
}

TEST(Topology, ErasesVoxelsWithTheirCentreInsideABox) {
  Topology topology({Eigen::Vector3d::Zero(), 1.0, Eigen::Vector3i(2, 1, 1)});
  topology.insert_brick({0, 0, 0}, BrickMask().set());
  topology.insert_brick({1, 0, 0}, BrickMask().set());
  topology.erase_inside({Eigen::Vector3d(6.4, 2.6, -1e30), Eigen::Vector3d(9.6, 3.4, 1e30)});
  EXPECT_EQ(topology.voxel_count(), 1024);  // no centre at y = 2.6 to 3.4
  topology.erase_inside({Eigen::Vector3d(6.4, 2.4, -1e30), Eigen::Vector3d(9.6, 3.4, 1e30)});
  EXPECT_EQ(topology.voxel_count(), 1024 - 4 * 1 * 8);
  for (int i = 0; i < 16; ++i) EXPECT_EQ(topology.contains({i, 2, 5}), i < 6 || i > 9) << i;
}

TEST(Topology, CopiesAreIndependent) {
  Topology original(small_frame());
  original.insert({1, 2, 3});
  Topology copy = original;
  copy.insert({4, 5, 6});
  EXPECT_EQ(original.voxel_count(), 1);
  original = copy;
  copy.erase_brick({0, 0, 0}, BrickMask().set());
  EXPECT_EQ(original.voxel_count(), 2);
  EXPECT_EQ(copy.voxel_count(), 0);
}
// So many bricks that every thread gets some.
Topology scattered_bricks(int side_in_bricks, double share) {
  std::mt19937 random(7);
  std::bernoulli_distribution has_voxels(share), exists(0.02);
  Topology topology({Eigen::Vector3d::Zero(), 1.0, Eigen::Vector3i::Constant(side_in_bricks)});
  std::vector<BrickVoxels> bricks;
  for (int z = 0; z < side_in_bricks; ++z)
    for (int y = 0; y < side_in_bricks; ++y)
      for (int x = 0; x < side_in_bricks; ++x) {
        if (!has_voxels(random)) continue;
        BrickVoxels& brick = bricks.emplace_back(BrickVoxels{{x, y, z}, {}});
        for (int v = 0; v < kBrickVoxels; ++v) brick.mask[v] = exists(random);
      }
  topology.insert_bricks(bricks);
  return topology;
}

TEST(Topology, EditsNeverDependOnTheNumberOfThreads) {
  const Topology before = scattered_bricks(14, 0.6);
  const std::vector<BrickVoxels> bricks = before.bricks();
  ASSERT_GT(bricks.size(), 1000u);
  const Eigen::AlignedBox3d hole(Eigen::Vector3d(21, 13, 40), Eigen::Vector3d(77, 90, 66));
  const auto edited = [&](int threads) {
    Topology topology(before.frame());
    topology.insert_bricks(bricks, threads);
    topology.dilate(3, threads);
    topology.erase_inside(hole, threads);
    return topology.subdivided(threads).bricks(threads);
  };
  const std::vector<BrickVoxels> one = edited(1);
  for (const int threads : {2, 4}) EXPECT_TRUE(edited(threads) == one) << threads << " threads";
}

TEST(Topology, ManyBricksAreInsertedAsOneByOne) {
  const std::vector<BrickVoxels> bricks = scattered_bricks(5, 0.7).bricks();
  Topology one_by_one(small_frame()), at_once(small_frame());
  for (Topology* topology : {&one_by_one, &at_once}) topology->insert({3, 4, 5});
  for (const BrickVoxels& brick : bricks) one_by_one.insert_brick(brick.brick, brick.mask);
  at_once.insert_bricks(bricks, 2);
  EXPECT_EQ(voxels(at_once), voxels(one_by_one));
  EXPECT_TRUE(at_once.contains({3, 4, 5}));
}

// Dilation takes a brick's width at most at once.
TEST(Topology, DilationOfMoreThanABrickGoesOn) {
  Topology topology({Eigen::Vector3d::Zero(), 1.0, Eigen::Vector3i(6, 5, 4)});
  topology.insert({23, 0, 31});
  topology.dilate(17);
  EXPECT_EQ(topology.voxel_count(), 35L * 18 * 18);
  EXPECT_TRUE(topology.contains({6, 17, 14}) && topology.contains({40, 0, 31}));
  EXPECT_FALSE(topology.contains({5, 0, 31}) || topology.contains({23, 18, 31}));
}

}  // namespace
}  // namespace roxel

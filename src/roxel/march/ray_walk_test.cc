#include "roxel/march/ray_walk.h"

#include <gtest/gtest.h>

#include "roxel/march/walk_fixture.h"

namespace roxel {
namespace {

std::vector<VoxelStep> walked(const LatticeStack& stack, const Ray& ray, Stretch range) {
  std::vector<VoxelStep> steps;
  stack.walk(
      ray, range, [](std::uint32_t) {},
      [&](const VoxelStep& step, const VoxelPlace&) {
        if (step.length >= kSliver) steps.push_back(step);
        return true;
      });
  return steps;
}

/// Whether the walk and the twin meet the same voxels in the same order with the same chords, depths too.
::testing::AssertionResult same_walk(const LatticeStack& stack, const Ray& ray, Stretch range) {
  const std::vector<VoxelStep> steps = walked(stack, ray, range);
  for (const VoxelStep& step : steps)
    if (!std::isfinite(step.depth)) return ::testing::AssertionFailure() << "a step without depth";
  return same_as_twin(stack.volume(), ray, range, steps);
}

TEST(RayWalk, MeetsWhatSortedPlaneCrossingsMeet) {
  std::mt19937 random(1);
  const Volume volume = one_lattice(0.5, {3, 2, 2}, random);
  const LatticeStack stack(volume);
  RandomRays rays(volume.index(0).frame().box(), 2);
  for (int i = 0; i < 50000; ++i) ASSERT_TRUE(same_walk(stack, rays.any(), {0, 20}));
  for (int i = 0; i < 50000; ++i) ASSERT_TRUE(same_walk(stack, rays.any(), rays.range()));
}

TEST(RayWalk, StartsInsideTheVolume) {
  std::mt19937 random(3);
  const Volume volume = one_lattice(0.6, {2, 2, 2}, random);
  const LatticeStack stack(volume);
  RandomRays rays(volume.index(0).frame().box(), 4);
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3d from = rays.point();
    ASSERT_TRUE(same_walk(stack, {from, rays.point() - from}, {0, 5}));
  }
}

TEST(RayWalk, PassesExactlyThroughFacesEdgesAndCorners) {
  std::mt19937 random(5);
  const Volume volume = one_lattice(0.6, {2, 2, 2}, random);
  const LatticeStack stack(volume);
  for (int i = 0; i < 20000; ++i)
    ASSERT_TRUE(same_walk(stack, ray_with_ties(volume.index(0).frame(), i % 3, random), {0, 30}));
}

TEST(RayWalk, GoesThroughNestedLatticesInwardsAndOut) {
  std::mt19937 random(6);
  const Volume volume = nested(0.5, 2, random);
  const LatticeStack stack(volume);
  RandomRays rays(volume.index(1).frame().box(), 7);
  for (int i = 0; i < 3000; ++i) ASSERT_TRUE(same_walk(stack, rays.any(), {0, 30}));
  for (int i = 0; i < 3000; ++i) ASSERT_TRUE(same_walk(stack, rays.any(), rays.range()));
}

TEST(RayWalk, NestedLatticesCoverARayOnceAndWhole) {
  std::mt19937 random(8);
  const Volume volume = nested(1, 3, random);
  const LatticeStack stack(volume);
  const Eigen::AlignedBox3d outermost = volume.index(3).frame().box();
  RandomRays rays(outermost, 9);
  for (int i = 0; i < 2000; ++i) {
    const Ray ray = rays.any();
    const Stretch inside = clip_to_box(ray, outermost, {0, 1e9});
    double covered = 0, last = 0;
    bool ordered = true;
    stack.walk(
        ray, {0, 1e9}, [](std::uint32_t) {},
        [&](const VoxelStep& step, const VoxelPlace& place) {
          covered += step.length * volume.index(place.lattice).frame().voxel_size;
          ordered &= step.depth >= last;
          last = step.depth;
          return true;
        });
    ASSERT_NEAR(covered, (inside.end - inside.begin) * ray.direction.norm(), 1e-5 * covered);
    ASSERT_TRUE(ordered);
  }
}

TEST(RayWalk, MissesWithoutAStep) {
  std::mt19937 random(10);
  const Volume volume = one_lattice(1, {1, 1, 1}, random);
  const LatticeStack stack(volume);
  EXPECT_TRUE(walked(stack, {{-5, 0, 0}, {1, 0, 0}}, {0, 100}).empty());
  EXPECT_TRUE(walked(stack, {{0, 2.5, 1}, {0, 0, 1}}, {10, 100}).empty());
  EXPECT_TRUE(walked(stack, {{0, 2.5, 1}, {0, 0, 1}}, {1, 0.5}).empty());
}

TEST(RayWalk, SaysWhereAVoxelIs) {
  std::mt19937 random(11);
  const Volume volume = one_lattice(0.7, {2, 2, 2}, random);
  const LatticeStack stack(volume);
  const LatticeFrame& frame = volume.index(0).frame();
  RandomRays rays(frame.box(), 12);
  for (int i = 0; i < 200; ++i) {
    const Ray ray = rays.any();
    stack.walk(
        ray, {0, 10}, [](std::uint32_t) {},
        [&](const VoxelStep& step, const VoxelPlace& place) {
          const Eigen::Vector3d cell = (frame.voxel_centre(place.voxel) - frame.origin) / frame.voxel_size;
          EXPECT_EQ(volume.index(0).slot(cell.array().floor().cast<int>().matrix()), step.slot);
          return true;
        });
  }
}

TEST(RayWalk, AnnouncesEachBrickBeforeItsFirstVoxel) {
  std::mt19937 random(13);
  const Volume volume = nested(0.3, 1, random);
  const LatticeStack stack(volume);
  RandomRays rays(volume.index(1).frame().box(), 14);
  for (int i = 0; i < 500; ++i) {
    std::vector<std::uint32_t> announced;
    bool in_last_announced = true;
    stack.walk(
        rays.any(), {0, 30}, [&](std::uint32_t brick) { announced.push_back(brick); },
        [&](const VoxelStep& step, const VoxelPlace&) {
          // Chunks run ahead of the visitor, so the brick is among those announced, not always the last.
          bool found = false;
          for (const std::uint32_t number : announced) {
            const Brick& brick = stack.brick(number);
            found |= step.slot >= brick.first_slot && step.slot < brick.first_slot + brick.count();
          }
          in_last_announced &= found;
          return true;
        });
    ASSERT_TRUE(in_last_announced);
    std::sort(announced.begin(), announced.end());
    ASSERT_EQ(std::adjacent_find(announced.begin(), announced.end()), announced.end());
  }
}

// Also along rays that pass many bricks without meeting a voxel of them.
TEST(RayWalk, ListsOnlyBricksThatHaveStepsInTheChunk) {
  std::mt19937 random(17);
  const Volume sparse = one_lattice(0.002, {300, 2, 2}, random), dense = one_lattice(0.5, {40, 3, 3}, random);
  for (const Volume* volume : {&sparse, &dense}) {
    const LatticeStack stack(*volume);
    RandomRays rays(volume->index(0).frame().box(), 18);
    StepChunk chunk;
    const auto listed = [](const StepChunk& steps) {
      for (int b = 0; b < steps.brick_count; ++b)
        if (steps.brick_begin[b] >= (b + 1 < steps.brick_count ? steps.brick_begin[b + 1] : steps.count))
          return false;
      return steps.brick_count <= steps.count;
    };
    const auto ignore = [](std::uint32_t) {};
    const Ray along{{-2, 3, 1.5}, {1, 0.0005, 0.0003}};
    for (int i = 0; i < 500; ++i)
      stack.walk_chunks(i == 0 ? along : rays.any(), {0, 1000}, nullptr, chunk, ignore,
                        [&](const StepChunk& steps) {
                          EXPECT_TRUE(listed(steps));
                          return true;
                        });
  }
}

TEST(RayWalk, StopsWhenTheVisitorSaysSo) {
  std::mt19937 random(15);
  const Volume volume = nested(1, 1, random);
  const LatticeStack stack(volume);
  const Ray ray{{-10, 0.1, 0.1}, {1, 0.01, 0.02}};
  const std::size_t all = walked(stack, ray, {0, 100}).size();
  for (std::size_t stop_at = 1; stop_at <= all; ++stop_at) {
    std::size_t seen = 0;
    stack.walk(
        ray, {0, 100}, [](std::uint32_t) {},
        [&](const VoxelStep&, const VoxelPlace&) { return ++seen < stop_at; });
    ASSERT_EQ(seen, stop_at);
  }
}

TEST(RayWalk, WeighsByClosestApproach) {
  const LatticeFrame frame{{0, 0, 0}, 1, {1, 1, 1}};
  Topology topology(frame);
  topology.insert({3, 3, 3});
  const Volume volume({topology});
  const LatticeStack stack(volume);
  const auto weight = [&](const Eigen::Vector3d& through, const Eigen::Vector3d& direction) {
    const std::vector<VoxelStep> steps = walked(stack, {through - 5 * direction, direction}, {0, 10});
    return steps.size() == 1 ? steps[0].weight : -1.0f;
  };
  const double vertex = std::sqrt(3.0) / 2;
  EXPECT_NEAR(weight({3.5, 3.5, 3.5}, {1, 0, 0}), 1, 1e-6);
  EXPECT_NEAR(weight({3.5, 3.5, 3.5}, {1, -2, 0.5}), 1, 1e-6);
  EXPECT_NEAR(weight({3.5, 3.8, 3.5}, {1, 0, 0}), 1 - 0.3 / vertex, 1e-6);
  EXPECT_NEAR(weight({3.5, 3.9, 3.9}, {1, 0, 0}), 1 - std::sqrt(0.32) / vertex, 1e-6);
  // Nearly over the vertex (4, 4, 4), at right angles to the diagonal: almost 0, and never below.
  const float touching = weight(Eigen::Vector3d::Constant(4 - 1e-3), {1, -1, 0});
  EXPECT_GE(touching, 0);
  EXPECT_NEAR(touching, 0, 4e-3);
}

// The weight is a difference of large numbers where a lattice is long: it must not lose its digits there.
TEST(RayWalk, WeighsAtTheEndsOfALongLattice) {
  const LatticeFrame frame{{-100, -0.05, -0.05}, 0.0125, {2048, 1, 1}};
  Topology topology(frame);
  for (const int x : {0, 1, 5000, 16382, 16383})
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) topology.insert({x, y, z});
  const Volume volume({topology});
  const LatticeStack stack(volume);
  std::mt19937 random(16);
  std::uniform_real_distribution<double> offset(-0.04, 0.04);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d from(-110, offset(random), offset(random)), to(115, offset(random), offset(random));
    const std::vector<VoxelStep> steps = walked(stack, {from, to - from}, {0, 2});
    const std::vector<TwinChord> chords = existing(volume, {from, to - from}, {0, 2});
    ASSERT_EQ(steps.size(), chords.size());
    for (std::size_t s = 0; s < steps.size(); ++s) ASSERT_NEAR(steps[s].weight, chords[s].weight, 5e-3);
  }
}

TEST(RayWalk, NumbersBricksOfAllLatticesInOneRange) {
  std::mt19937 random(17);
  const Volume volume = nested(0.3, 2, random);
  const LatticeStack stack(volume);
  std::uint32_t number = 0;
  for (int k = 0; k < volume.lattice_count(); ++k) {
    EXPECT_EQ(stack.first_brick(k), number);
    for (const Brick& brick : volume.index(k).bricks()) EXPECT_EQ(&stack.brick(number++), &brick);
  }
  EXPECT_EQ(stack.brick_count(), number);
}

TEST(ClipToBox, KeepsWhatIsInside) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 2, 3));
  const Stretch along = clip_to_box({{-2, 1, 1}, {2, 0, 0}}, box, {0, 10});
  EXPECT_DOUBLE_EQ(along.begin, 1);
  EXPECT_DOUBLE_EQ(along.end, 1.5);
  const Stretch backwards = clip_to_box({{3, 1, 1}, {-1, 0, 0}}, box, {2.5, 10});
  EXPECT_DOUBLE_EQ(backwards.begin, 2.5);
  EXPECT_DOUBLE_EQ(backwards.end, 3);
  const auto misses = [&](const Ray& ray) {
    const Stretch hit = clip_to_box(ray, box, {0, 10});
    return hit.end <= hit.begin;
  };
  EXPECT_TRUE(misses({{-2, 2.5, 1}, {1, 0, 0}}));
  EXPECT_TRUE(misses({{-2, 1, 1}, {-1, 0, 0}}));
  EXPECT_TRUE(misses({{-1, 0, 1}, {1, 3, 0}}));
}

}  // namespace
}  // namespace roxel

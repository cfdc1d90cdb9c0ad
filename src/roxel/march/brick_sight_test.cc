#include "roxel/march/brick_sight.h"

#include <gtest/gtest.h>

#include <random>

namespace roxel {
namespace {

/// Bricks here and there in a box with one surround lattice.
Volume scattered_volume(std::mt19937& random) {
  Topology box(LatticeFrame{{-12, -12, -12}, 1, {3, 3, 3}});
  Topology around(LatticeFrame{{-24, -24, -24}, 2, {3, 3, 3}});
  std::bernoulli_distribution exists(0.02);
  for (Topology* topology : {&box, &around})
    for (int z = 0; z < 24; ++z)
      for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 24; ++x)
          if (exists(random) && (x < 9 || y > 16)) topology->insert({x, y, z});
  around.erase_inside(box.frame().box());
  return Volume({box, around});
}

PinholeCamera random_camera(double distance, std::mt19937& random) {
  std::normal_distribution<double> normal(0, 1);
  PinholeCamera camera;
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
  camera.pose.rotation = turn.toRotationMatrix();
  const Eigen::Vector3d aside(normal(random), normal(random), 0);
  camera.pose.centre =
      -distance * camera.pose.rotation.row(2).transpose() + camera.pose.rotation.transpose() * aside;
  camera.intrinsics = {101, 67, 80, 85, 47, 36, 0.7};
  return camera;
}

class BrickSightTest : public testing::TestWithParam<double> {};

// The walk cut to what is in sight meets the voxels of the whole walk, with the same chords.
TEST_P(BrickSightTest, CutsNoVoxelAway) {
  std::mt19937 random(7);
  std::int64_t met = 0;
  double cut = 0, whole = 0;
  for (int trial = 0; trial < 8; ++trial) {
    const Volume volume = scattered_volume(random);
    const LatticeStack stack(volume);
    const PinholeCamera camera = random_camera(GetParam(), random);
    const BrickSight sight(stack, camera);
    const Stretch range{0.01, 120};
    for (int y = 0; y < 67; ++y)
      for (int x = 0; x < 101; ++x) {
        const Ray ray = camera.ray(x + 0.5, y + 0.5);
        std::vector<std::uint32_t> expected, slots;
        std::vector<float> lengths;
        StepChunk chunk;
        const auto nothing = [](std::uint32_t) {};
        stack.walk_chunks(ray, range, nullptr, chunk, nothing, [&](const StepChunk& steps) {
          for (int i = 0; i < steps.count; ++i)
            if (steps.length[i] > 1e-5f)
              expected.push_back(steps.slot[i]), lengths.push_back(steps.length[i]);
          return true;
        });
        std::size_t same = 0;
        stack.walk_chunks(ray, range, sight.at(x + 0.5, y + 0.5), chunk, nothing,
                          [&](const StepChunk& steps) {
                            for (int i = 0; i < steps.count; ++i) {
                              if (steps.length[i] <= 1e-5f) continue;
                              slots.push_back(steps.slot[i]);
                              if (same < lengths.size()) {
                                EXPECT_NEAR(steps.length[i], lengths[same], 1e-5f);
                              }
                              ++same;
                            }
                            return true;
                          });
        ASSERT_EQ(slots, expected);
        met += slots.size();
        for (int k = 0; k < 2; ++k) {
          const Stretch& seen = sight.at(x + 0.5, y + 0.5)[k];
          cut += std::max(0.0, std::min(range.end, seen.end) - std::max(range.begin, seen.begin));
          whole += range.end - range.begin;
        }
      }
  }
  EXPECT_GT(met, 1000);
  EXPECT_LT(cut, 0.7 * whole);
}

INSTANTIATE_TEST_SUITE_P(OutsideAndInside, BrickSightTest, testing::Values(60.0, 30.0, 6.0));

TEST(BrickSight, IsEmptyWhereThereIsNothing) {
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {4, 1, 1}});
  topology.insert({1, 1, 1});
  const Volume volume({topology});
  PinholeCamera camera;
  camera.pose.centre = {4, 4, -20};
  camera.intrinsics = {200, 200, 200, 200, 100, 100, 0};
  const BrickSight sight(LatticeStack(volume), camera);
  EXPECT_LT(sight.at(100, 100)->begin, 20 + 1e-3);
  EXPECT_GT(sight.at(100, 100)->end, 28 - 1e-3);
  EXPECT_GT(sight.at(0.5, 0.5)->begin, sight.at(0.5, 0.5)->end);
  EXPECT_GT(sight.at(200, 100)->begin, sight.at(200, 100)->end);
}

}  // namespace
}  // namespace roxel

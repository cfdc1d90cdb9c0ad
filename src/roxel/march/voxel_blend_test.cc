#include "roxel/march/voxel_blend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

namespace roxel {
namespace {

/// All voxels of two bricks along x but those of `missing`.
BrickIndex index_without(const std::vector<Eigen::Vector3i>& missing) {
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {2, 1, 1}});
  for (int z = 0; z < 8; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 16; ++x)
        if (std::find(missing.begin(), missing.end(), Eigen::Vector3i(x, y, z)) == missing.end())
          topology.insert({x, y, z});
  return BrickIndex(topology, 0);
}

std::map<std::uint32_t, float> weights_at(const BrickIndex& index, const Eigen::Vector3d& at) {
  const VoxelBlend blend = blend_around(index, at);
  std::map<std::uint32_t, float> weights;
  for (int i = 0; i < blend.count; ++i) weights[blend.slot[i]] += blend.weight[i];
  return weights;
}

TEST(VoxelBlend, InTheMiddleOfAVoxelIsThatVoxel) {
  const BrickIndex index = index_without({});
  auto weights = weights_at(index, {3.5, 2.5, 4.5});
  EXPECT_FLOAT_EQ(weights[index.slot({3, 2, 4})], 1);
}

TEST(VoxelBlend, IsLinearAlongEachAxisAlsoFromBrickToBrick) {
  const BrickIndex index = index_without({});
  // The field x + 10 y + 100 z of the centres comes out as itself, also across the bricks' border at x = 8.
  for (const Eigen::Vector3d& at :
       {Eigen::Vector3d(2.7, 3.1, 4.9), Eigen::Vector3d(8.2, 1.5, 6.25), Eigen::Vector3d(7.9, 7.0, 2.0)}) {
    double field = 0, sum = 0;
    const VoxelBlend blend = blend_around(index, at);
    EXPECT_EQ(blend.count, 8);
    for (int i = 0; i < blend.count; ++i) {
      bool found = false;
      for (int z = 0; z < 8; ++z)
        for (int y = 0; y < 8; ++y)
          for (int x = 0; x < 16; ++x)
            if (index.slot({x, y, z}) == blend.slot[i]) {
              field += blend.weight[i] * ((x + 0.5) + 10 * (y + 0.5) + 100 * (z + 0.5));
              found = true;
            }
      EXPECT_TRUE(found);
      sum += blend.weight[i];
    }
    EXPECT_NEAR(sum, 1, 1e-6);
    EXPECT_NEAR(field, at.x() + 10 * at.y() + 100 * at.z(), 1e-3);
  }
}

TEST(VoxelBlend, WhatIsMissingIsMadeUpForByTheOthers) {
  const BrickIndex index = index_without({{4, 2, 3}});
  // On the line between the centres of (3, 2, 3) and the missing (4, 2, 3).
  auto weights = weights_at(index, {3.75, 2.5, 3.5});
  EXPECT_FLOAT_EQ(weights[index.slot({3, 2, 3})], 1);
}

TEST(VoxelBlend, AtTheEdgeOfTheLatticeOnlyItsOwnVoxelsCount) {
  const BrickIndex index = index_without({});
  auto weights = weights_at(index, {0.25, 0.5, 0.5});
  EXPECT_FLOAT_EQ(weights[index.slot({0, 0, 0})], 1);
  auto far_end = weights_at(index, {15.75, 7.75, 7.0});
  EXPECT_FLOAT_EQ(far_end[index.slot({15, 7, 6})], 0.5f);
  EXPECT_FLOAT_EQ(far_end[index.slot({15, 7, 7})], 0.5f);
}

}  // namespace
}  // namespace roxel

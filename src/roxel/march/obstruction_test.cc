#include "roxel/march/obstruction.h"

#include <gtest/gtest.h>

#include <cmath>

namespace roxel {
namespace {

/// One column of eight voxels along z; those at 3 and 5 are there.
Volume two_voxels(float tau_3, float tau_5) {
  Topology topology(LatticeFrame{Eigen::Vector3d::Zero(), 1, Eigen::Vector3i::Ones()});
  topology.insert({4, 4, 3});
  topology.insert({4, 4, 5});
  Volume volume({topology});
  volume.resize_channels();
  volume.tau[volume.index(0).slot({4, 4, 3})] = tau_3;
  volume.tau[volume.index(0).slot({4, 4, 5})] = tau_5;
  return volume;
}

TEST(Obstruction, LightFallsByTheOpticalDepthOfTheWay) {
  const Volume volume = two_voxels(0.5f, 1.25f);
  const LatticeStack stack(volume);
  ObstructionMarch march(stack);
  const Obstruction up = march.look({4.5, 4.5, 1}, {0, 0, 1});
  EXPECT_NEAR(up.transmittance, std::exp(-1.75), 1e-5);
  EXPECT_EQ(up.at, volume.index(0).slot({4, 4, 5}));
  const Obstruction from_between = march.look({4.5, 4.5, 4.5}, {0, 0, -1});
  EXPECT_NEAR(from_between.transmittance, std::exp(-0.5), 1e-5);
  EXPECT_EQ(from_between.at, volume.index(0).slot({4, 4, 3}));
}

TEST(Obstruction, IsNoneBesideTheVoxelsAndBehindThem) {
  const Volume volume = two_voxels(3, 3);
  const LatticeStack stack(volume);
  ObstructionMarch march(stack);
  EXPECT_EQ(march.look({2.5, 4.5, 1}, {0, 0, 1}).transmittance, 1);
  EXPECT_EQ(march.look({4.5, 4.5, 6.5}, {0, 0, 1}).transmittance, 1);
  EXPECT_EQ(march.look({4.5, 4.5, 6.5}, {0, 0, 1}).at, kNoSlot);
}

TEST(Obstruction, OfAnOpaqueWayIsWhole) {
  const Volume volume = two_voxels(16, 16);
  const LatticeStack stack(volume);
  const Obstruction up = ObstructionMarch(stack).look({4.5, 4.5, -10}, {0, 0, 1});
  EXPECT_EQ(up.transmittance, 0);
  EXPECT_EQ(up.at, volume.index(0).slot({4, 4, 3}));
}

}  // namespace
}  // namespace roxel

#include "roxel/eval/sky_debris.h"

#include <gtest/gtest.h>

namespace roxel {
namespace {

using Eigen::Vector3d;

/// A roof [0, 4] x [0, 4] at height 2, over ground from -10 to 10 at height 0.
Mesh roof_over_ground() {
  return {
      {{0, 0, 2}, {4, 0, 2}, {4, 4, 2}, {0, 4, 2}, {-10, -10, 0}, {10, -10, 0}, {10, 10, 0}, {-10, 10, 0}},
      {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}}};
}

/// At x = -5, y = 2, height 1, looking along +X, 90 degrees wide and high: row 0 is up.
PinholeCamera looking_along_x() {
  PinholeCamera camera;
  camera.intrinsics = {100, 100, 50, 50, 50, 50, 0};
  camera.pose.centre = {-5, 2, 1};
  Eigen::Matrix3d rotation;  // rows: right, down, forward
  rotation << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  camera.pose.rotation = rotation;
  return camera;
}

std::vector<SkyStand> stands(const std::vector<Vector3d>& places, double clearance = 0.5, int threads = 1) {
  return sky_stands(roof_over_ground(), places, std::vector{looking_along_x()},
                    {Vector3d::UnitZ(), clearance, 0.2}, threads);
}

TEST(SkyDebris, WhatHasARoofAboveIsNotInTheOpen) {
  const auto found = stands({{2, 2, 1}, {2, 2, 3}, {-2, 2, 1}, {2, 2, -1}});
  EXPECT_FALSE(found[0].in_the_open);
  EXPECT_TRUE(found[1].in_the_open);
  EXPECT_TRUE(found[2].in_the_open);
  EXPECT_FALSE(found[3].in_the_open);  // below ground
}

TEST(SkyDebris, WhatIsWithinTheClearanceIsSurface) {
  EXPECT_FALSE(stands({{2, 2, 2.5}}, 0.5)[0].in_the_open);
  EXPECT_TRUE(stands({{2, 2, 2.51}}, 0.5)[0].in_the_open);
}

TEST(SkyDebris, AboveAllIsHigherThanTheHighestRoof) {
  const auto found = stands({{2, 2, 2.6}, {-8, 2, 2.6}, {-8, 2, 1.9}, {2, 2, 2.4}});
  EXPECT_TRUE(found[0].above_all);
  EXPECT_TRUE(found[1].above_all);
  EXPECT_FALSE(found[2].above_all);
  EXPECT_FALSE(found[3].above_all);  // within the clearance
}

TEST(SkyDebris, AVoxelThatIsPartlyBeforeARoofIsNotBeforeTheSky) {
  // Seen from below, the roof's far edge (4, 2) is at height 2.5 above x = 8.5; the roof is above that ray.
  EXPECT_TRUE(stands({{8.5, 2, 2.35}}, 0.3)[0].before_sky);
  EXPECT_FALSE(stands({{8.5, 2, 2.45}}, 0.3)[0].before_sky);  // its upper corners are behind the roof
}

TEST(SkyDebris, UpIsWhereItIsSaidToBe) {
  const auto found = sky_stands(roof_over_ground(), std::vector<Vector3d>{{2, 2, 1}, {2, 2, -1}}, {},
                                {-Vector3d::UnitZ(), 0.5, 0.2}, 1);
  EXPECT_FALSE(found[0].in_the_open);  // the ground
  EXPECT_TRUE(found[1].in_the_open);
}

TEST(SkyDebris, AVoxelIsBeforeTheSkyWhereItsRayMeetsNothingAtAll) {
  // Level with the camera under the roof, over its edge, down to the ground, and up where no image reaches.
  const auto found = stands({{2, 2, 1}, {2, 2, 4}, {-2, 2, 0.6}, {-4.5, 2, 4}, {-6, 2, 4}});
  EXPECT_TRUE(found[0].before_sky);
  EXPECT_TRUE(found[1].before_sky);
  EXPECT_FALSE(found[2].before_sky);                   // the ground is behind it
  EXPECT_FALSE(found[3].before_sky);                   // above the image
  EXPECT_FALSE(found[4].before_sky);                   // behind the camera
  EXPECT_FALSE(stands({{6, 2, 2.65}})[0].before_sky);  // the roof is before it
}

TEST(SkyDebris, ThreadsDoNotMatter) {
  std::vector<Vector3d> places;
  for (int i = 0; i < 1000; ++i) places.emplace_back(-4 + 0.013 * i, 0.3 + 0.003 * i, 0.004 * i);
  const auto one = stands(places, 0.5, 1), four = stands(places, 0.5, 4);
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(one[i].in_the_open, four[i].in_the_open);
    EXPECT_EQ(one[i].above_all, four[i].above_all);
    EXPECT_EQ(one[i].before_sky, four[i].before_sky);
  }
}

TEST(SkyDebris, SharesAreOfVoxelsAndOfOpacity) {
  const std::vector<float> opacity{0.1f, 0.3f, 0.6f, 1.0f};
  const std::vector<SkyStand> stands{{true, true, true}, {true, false, false}, {}, {}};
  const SkyDebris all = sky_debris(opacity, stands, 0.04), opaque = sky_debris(opacity, stands, 0.3);
  EXPECT_EQ(all.all.voxels, 4);
  EXPECT_DOUBLE_EQ(all.share(all.in_the_open), 0.5);
  EXPECT_DOUBLE_EQ(all.share(all.before_sky), 0.25);
  EXPECT_DOUBLE_EQ(all.share(all.above_all), 0.25);
  EXPECT_NEAR(all.share_of_opacity(all.in_the_open), 0.2, 1e-6);
  EXPECT_NEAR(all.share_of_opacity(all.before_sky), 0.05, 1e-6);
  EXPECT_EQ(opaque.all.voxels, 3);
  EXPECT_EQ(opaque.in_the_open.voxels, 1);
  EXPECT_EQ(opaque.before_sky.voxels, 0);
  const SkyDebris none = sky_debris({}, {}, 0.04);
  EXPECT_EQ(none.share(none.before_sky), 0);
}

}  // namespace
}  // namespace roxel

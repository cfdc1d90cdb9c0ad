#include "roxel/depth/scaled_view.h"

#include <gtest/gtest.h>

#include "roxel/depth/refine_fixture.h"

namespace roxel {
namespace {

using fixture::SlantedPlane;

TEST(ChooseScale, LeavesTheMedianVoxelOneAndAHalfPixels) {
  const double large = 1e9;
  EXPECT_EQ(choose_scale({1.6}, {large}), 1);
  EXPECT_EQ(choose_scale({2.9, 2.9, 40}, {large}), 1);
  EXPECT_EQ(choose_scale({3.0}, {large}), 2);
  EXPECT_EQ(choose_scale({0, 0, 0, 6.5, 6.5}, {large}), 4);  // views without depth say nothing
  EXPECT_EQ(choose_scale({1e9}, {large}), 16);
  EXPECT_EQ(choose_scale({}, {}), 1);
}

TEST(ChooseScale, LeavesTheMedianView100000Pixels) {
  EXPECT_EQ(choose_scale({20}, {352 * 288}), 1);
  EXPECT_EQ(choose_scale({20}, {399999}), 1);
  EXPECT_EQ(choose_scale({20}, {400000}), 2);
  EXPECT_EQ(choose_scale({20}, {100, 800 * 600, 1600 * 1200}), 2);
  EXPECT_EQ(choose_scale({20}, {1.6e6}), 4);
}

TEST(VoxelInPixels, IsThatOfTheMedianDepth) {
  Image depth(40, 40, 1);
  EXPECT_EQ(voxel_in_pixels(depth, 100, 0.1), 0);
  for (int x = 0; x < 40; ++x)
    for (int y = 0; y < 40; ++y) *depth.pixel(x, y) = x < 10 ? 0.0f : x < 15 ? 50.0f : 5.0f;
  EXPECT_NEAR(voxel_in_pixels(depth, 100, 0.1), 2, 1e-6);
}

TEST(SurestPixels, HaveDepthAndTheLeastVariance) {
  Image depth(4, 2, 1, 2.0f), variance(4, 2, 1, 1.0f);
  *variance.pixel(1, 1) = 0.5f;
  for (const int x : {2, 3})
    for (const int y : {0, 1}) *depth.pixel(x, y) = 0;
  EXPECT_EQ(surest_pixels(depth, variance, 2), (std::vector<std::int64_t>{5, -1}));
  *variance.pixel(0, 0) = 0.1f;
  *depth.pixel(0, 0) = 0;  // sure, but of nothing
  EXPECT_EQ(surest_pixels(depth, variance, 2).front(), 5);
  EXPECT_EQ(surest_pixels(depth, variance, 1)[3], -1);
}

// The small view's planes are exact: so is every pixel of the large one.
TEST(PlaneOfPixel, IsExactOnAPlane) {
  const PinholeCamera camera = SlantedPlane::camera(0.2, -0.1), half = scaled(camera, 2);
  PlaneMap planes(36, 28);
  for (int y = 0; y < 28; ++y)
    for (int x = 0; x < 36; ++x)
      planes.at(x, y) = plane_of_normal(half, 1 / SlantedPlane::depth(half.ray(x + 0.5, y + 0.5)),
                                        SlantedPlane::normal(), x + 0.5, y + 0.5);
  for (int y = 0; y < 56; ++y)
    for (int x = 0; x < 72; ++x) {
      const double z = SlantedPlane::depth(camera.ray(x + 0.5, y + 0.5));
      const PlaneOfPixel found = plane_of_pixel(planes, 2, x, y, z);
      ASSERT_NEAR(1 / found.plane.w, z, 1e-5);
      const Eigen::Vector3d normal = world_normal(camera, found.plane, x + 0.5, y + 0.5);
      ASSERT_GT(normal.dot(SlantedPlane::normal()), 1 - 1e-6);
    }
}

TEST(PlaneOfPixel, BelongsToTheSurfaceThatThePixelShows) {
  PlaneMap planes(2, 1);
  planes.at(0, 0) = {0.5f, 0, 0};   // depth 2
  planes.at(1, 0) = {0.25f, 0, 0};  // depth 4
  EXPECT_EQ(plane_of_pixel(planes, 4, 3, 1, 2.1).plane.w, 0.5f);
  EXPECT_EQ(plane_of_pixel(planes, 4, 3, 1, 3.9).plane.w, 0.25f);
  EXPECT_EQ(plane_of_pixel(planes, 4, 3, 1, 3.9).column, 1);
  EXPECT_EQ(plane_of_pixel(planes, 1, 1, 0, 2.0).plane.w, 0.25f);  // at full size each has its own
  planes.at(0, 0) = planes.at(1, 0) = {};
  EXPECT_TRUE(plane_of_pixel(planes, 4, 3, 1, 2.0).plane.empty());
}

}  // namespace
}  // namespace roxel

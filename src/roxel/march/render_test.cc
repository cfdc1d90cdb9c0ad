#include "roxel/march/render.h"

#include <gtest/gtest.h>

#include <cmath>

#include "roxel/base/error.h"

namespace roxel {
namespace {

/// One pixel that looks along x from x = -3, through the centres of voxels (0..7, 0, 0) of size 1.
PinholeCamera camera_along_x() {
  PinholeCamera camera;
  camera.intrinsics = {1, 1, 1000, 1000, 0.5, 0.5, 0};
  camera.pose.rotation << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  camera.pose.centre = {-3, 0.5, 0.5};
  return camera;
}

constexpr double kOpacity[3] = {0.5, 0.25, 0.8};
const std::vector<std::array<float, 3>> kColors = {{1, 0, 0}, {0, 1, 0}, {0, 0.5f, 1}};

/// Voxels at x = 1, 2 and 5.
Volume three_voxels() {
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {1, 1, 1}});
  for (const int x : {1, 2, 5}) topology.insert({x, 0, 0});
  Volume volume({topology});
  for (int i = 0; i < 3; ++i) volume.tau[i] = static_cast<float>(-std::log1p(-kOpacity[i]));
  return volume;
}

TEST(Render, ThreeVoxelsByHand) {
  const Volume volume = three_voxels();
  const LatticeStack stack(volume);
  RenderOptions options;
  options.background = {0.2f, 0.4f, 0.6f};
  const Rendering seen = render(stack, kColors, camera_along_x(), {0, 100}, options, RunContext(1));
  const double r[3] = {0.5, 0.5 * 0.25, 0.375 * 0.8};
  const double r_bg = 0.375 * 0.2;
  for (int c = 0; c < 3; ++c) {
    double expected = r_bg * options.background[c];
    for (int i = 0; i < 3; ++i) expected += r[i] * kColors[i][c];
    EXPECT_NEAR(seen.rgb.pixel(0, 0)[c], expected, 1e-6);
  }
  EXPECT_NEAR(*seen.opacity.pixel(0, 0), 1 - r_bg, 1e-6);
  // Chord middles at x = 1.5, 2.5, 5.5, from x = -3.
  EXPECT_NEAR(*seen.depth.pixel(0, 0), (r[0] * 4.5 + r[1] * 5.5 + r[2] * 8.5) / (1 - r_bg), 1e-5);
}

TEST(Render, RangeCutsChords) {
  const Volume volume = three_voxels();
  const LatticeStack stack(volume);
  // From depth 4.5 (x = 1.5) to 5.25 (x = 2.25): half of the first voxel, a quarter of the second.
  const Rendering seen = render(stack, kColors, camera_along_x(), {4.5, 5.25}, {}, RunContext(1));
  const double clear = std::sqrt(0.5) * std::pow(0.75, 0.25);
  EXPECT_NEAR(*seen.opacity.pixel(0, 0), 1 - clear, 1e-6);
}

TEST(Render, SurroundIsColourButNotDepth) {
  Topology box(LatticeFrame{{0, 0, 0}, 1, {4, 4, 4}});
  Topology around(LatticeFrame{{-16, -16, -16}, 2, {4, 4, 4}});
  box.insert({4, 0, 0});
  around.insert({0, 8, 8});  // x from -16 to -14, before the box
  Volume volume({box, around});
  volume.tau = {static_cast<float>(std::log(2.0)), static_cast<float>(std::log(4.0))};
  const LatticeStack stack(volume);
  PinholeCamera camera = camera_along_x();
  camera.pose.centre.x() = -20;
  const std::vector<std::array<float, 3>> colors = {{1, 0, 0}, {0, 1, 0}};

  const Rendering with = render(stack, colors, camera, {0, 100}, {}, RunContext(1));
  EXPECT_NEAR(with.rgb.pixel(0, 0)[1], 0.75, 1e-6);
  EXPECT_NEAR(with.rgb.pixel(0, 0)[0], 0.125, 1e-6);
  EXPECT_NEAR(*with.opacity.pixel(0, 0), 0.125, 1e-6);
  EXPECT_NEAR(*with.depth.pixel(0, 0), 24.5, 1e-4);

  RenderOptions options;
  options.surround = false;
  const Rendering without = render(stack, colors, camera, {0, 100}, options, RunContext(1));
  EXPECT_NEAR(without.rgb.pixel(0, 0)[1], 0, 1e-6);
  EXPECT_NEAR(without.rgb.pixel(0, 0)[0], 0.5, 1e-6);
}

TEST(Render, NothingSeenHasNoDepth) {
  Volume volume = three_voxels();
  std::fill(volume.tau.begin(), volume.tau.end(), 0.0f);
  const LatticeStack stack(volume);
  RenderOptions options;
  options.background = {0.1f, 0.2f, 0.3f};
  const Rendering seen = render(stack, kColors, camera_along_x(), {0, 100}, options, RunContext(1));
  EXPECT_EQ(*seen.depth.pixel(0, 0), 0);
  EXPECT_EQ(*seen.opacity.pixel(0, 0), 0);
  for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(seen.rgb.pixel(0, 0)[c], options.background[c]);
}

TEST(Render, ColoursBetweenCentresAreInterpolated) {
  // A slanted ray through a row of opaque voxels at z = 0 whose colours rise along x.
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {1, 1, 1}});
  for (int x = 0; x < 8; ++x) topology.insert({x, 0, 0});
  Volume volume({topology});
  std::fill(volume.tau.begin(), volume.tau.end(), 16.0f);
  std::vector<std::array<float, 3>> colors(8);
  for (int x = 0; x < 8; ++x) colors[x] = {static_cast<float>(x), 1, 0};
  PinholeCamera camera;
  camera.intrinsics = {1, 1, 1000, 1000, 0.5, 0.5, 0};
  camera.pose.rotation << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  camera.pose.centre = {3.75, 0.5, 5};
  const LatticeStack stack(volume);
  RenderOptions options;
  EXPECT_NEAR(render(stack, colors, camera, {0, 100}, options, RunContext(1)).rgb.pixel(0, 0)[0], 3, 1e-5);
  options.interpolate = true;
  const Rendering seen = render(stack, colors, camera, {0, 100}, options, RunContext(1));
  EXPECT_NEAR(seen.rgb.pixel(0, 0)[0], 3.25, 1e-5);
  EXPECT_NEAR(seen.rgb.pixel(0, 0)[1], 1, 1e-5);
}

TEST(Render, AWidePixelIsTheMeanOfFourRays) {
  // Half of the pixel sees the voxel at x = 3, half sees past it.
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {1, 1, 1}});
  topology.insert({3, 0, 0});
  Volume volume({topology});
  volume.tau[0] = 16;
  PinholeCamera camera;
  camera.intrinsics = {1, 1, 5, 5, 0.5, 0.5, 0};
  camera.pose.rotation << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  camera.pose.centre = {4, 0.5, 5};
  RenderOptions options;
  options.background = {0, 1, 0};
  const SubpixelRays rays(volume.index(0).frame(), camera);
  ASSERT_EQ(rays.count(), 4);
  const Rendering seen = render(LatticeStack(volume), {{1, 0, 0}}, camera, {0, 100}, options, RunContext(1));
  EXPECT_NEAR(*seen.opacity.pixel(0, 0), 0.5, 1e-5);
  EXPECT_NEAR(seen.rgb.pixel(0, 0)[0], 0.5, 1e-5);
  EXPECT_NEAR(seen.rgb.pixel(0, 0)[1], 0.5, 1e-5);
  EXPECT_NEAR(*seen.depth.pixel(0, 0), 4.5, 1e-2);
}

TEST(Render, StopsWhenCancelled) {
  const Volume volume = three_voxels();
  const LatticeStack stack(volume);
  RunContext context(1);
  context.cancel();
  EXPECT_THROW(render(stack, kColors, camera_along_x(), {0, 100}, {}, context), Cancelled);
}

}  // namespace
}  // namespace roxel

#include "roxel/solve/surface_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace roxel {
namespace {

constexpr int kSide = 32;

/// Opaque ground in the layer z = 4, and a wall in the layer x = 20, from the ground to the top.
Volume ground_and_wall() {
  const LatticeFrame frame{Eigen::Vector3d::Zero(), 1, Eigen::Vector3i::Constant(kSide / 8)};
  Topology topology(frame);
  for (int k = 0; k < kSide; ++k)
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i)
        if ((k >= 3 && k <= 5) || (k > 3 && i >= 19 && i <= 21)) topology.insert({i, j, k});
  Volume volume({topology});
  volume.resize_channels();
  for (int b = 0; b < kSide; ++b)
    for (int a = 0; a < kSide; ++a) {
      volume.tau[volume.index(0).slot({a, b, 4})] = 6;
      if (a > 4) volume.tau[volume.index(0).slot({20, b, a})] = 6;
    }
  return volume;
}

/// A white dome; the sun, in the west (-x) at 45 degrees, gives as much on a surface that faces it.
Daylight white_day() {
  NodeSky sky;
  sky.model = SkyModel::kUniform;
  for (PerezChannel& channel : sky.channels) channel.scale = 1;
  NodeSky sunny = sky;
  sunny.sun_light = SunLight::kMeasured;
  sunny.sun_source = SunSource::kGiven;
  sunny.sun = Eigen::Vector3d(-1, 0, 1).normalized();
  sunny.sun_irradiance = Eigen::Vector3d::Constant(std::numbers::pi);
  return {{sky, sunny}, {0, 1, -1}, {}};
}

class OnGroundAndWall : public testing::Test {
 protected:
  SurfaceLight light(int threads = 2) const {
    const std::vector<Eigen::Vector3f> towards(volume_.slot_count(), Eigen::Vector3f(-1, 0, 1));
    return SurfaceLight(LatticeStack(volume_), surface_voxels(volume_, 0.5f, towards, threads), day_,
                        RunContext(threads));
  }
  std::size_t place(const SurfaceLight& light, int i, int j, int k) const {
    const std::int32_t found = light.voxels().places[volume_.index(0).slot({i, j, k})];
    EXPECT_GE(found, 0);
    return static_cast<std::size_t>(std::max(0, found));
  }
  Volume volume_ = ground_and_wall();
  Daylight day_ = white_day();
  double unit_ = mean_light(day_);
};

TEST_F(OnGroundAndWall, NormalsLookToWhereSurfacesAreSeenFrom) {
  const SurfaceLight lit = light();
  EXPECT_GT(lit.voxels().normals[place(lit, 10, 16, 4)].z(), 0.99f);
  EXPECT_LT(lit.voxels().normals[place(lit, 20, 16, 20)].x(), -0.99f);
}

TEST_F(OnGroundAndWall, OpenGroundHasTheLightOfTheWholeDome) {
  const SurfaceLight lit = light();
  const std::size_t open = place(lit, 2, 16, 4);
  EXPECT_NEAR(lit.at(0, open)[1] * unit_, 0.9, 0.05);  // the wall, 18 away, hides some
  EXPECT_EQ(lit.sunlit(1, open), 1);
  EXPECT_NEAR(lit.sun(1, open)[1] * unit_, std::sqrt(0.5), 0.01);
  EXPECT_EQ(lit.sunlit(0, open), 0);  // that sky has no sun
}

TEST_F(OnGroundAndWall, BehindTheWallThereIsShadowAndHalfADome) {
  const SurfaceLight lit = light();
  const std::size_t behind = place(lit, 23, 16, 4);
  EXPECT_LT(lit.sunlit(1, behind), 0.01f);
  EXPECT_NEAR(lit.diffuse(1, behind)[1] * unit_, 0.55, 0.15);
}

TEST_F(OnGroundAndWall, AWallSeesHalfTheSky) {
  const SurfaceLight lit = light();
  EXPECT_NEAR(lit.diffuse(0, place(lit, 20, 16, 20))[1] * unit_, 0.5, 0.06);
}

TEST_F(OnGroundAndWall, WhiteGroundLightsTheWallFromBelow) {
  SurfaceLight lit = light();
  const std::size_t wall = place(lit, 20, 16, 12);
  const float before = lit.diffuse(0, wall)[1];
  lit.add_bounce(std::vector<Rgb>(lit.voxels().count(), Rgb{0, 0, 0}), RunContext(1));
  EXPECT_EQ(lit.diffuse(0, wall)[1], before);  // black surfaces give nothing back
  lit.add_bounce(std::vector<Rgb>(lit.voxels().count(), Rgb{0.8f, 0.8f, 0.8f}), RunContext(1));
  EXPECT_GT(lit.diffuse(0, wall)[1], 1.15f * before);
  EXPECT_LT(lit.diffuse(0, wall)[1], 1.5f * before);
}

TEST_F(OnGroundAndWall, WhereThereIsNoSurfaceItIsThatOfTheHorizontal) {
  const SurfaceLight lit = light();
  const std::uint32_t air = volume_.index(0).slot({2, 2, 5});
  EXPECT_EQ(lit.voxels().places[air], -1);
  EXPECT_NEAR(lit.of(0, air)[1] * unit_, 1, 0.02);
  EXPECT_EQ(lit.of(-1, air), (Rgb{1, 1, 1}));
  EXPECT_EQ(lit.sky_of_view(1), 1);
  EXPECT_EQ(lit.sky_of_view(2), -1);
}

TEST_F(OnGroundAndWall, LightDoesNotDependOnThreads) {
  const SurfaceLight one = light(1), four = light(4);
  for (std::size_t p = 0; p < one.voxels().count(); ++p)
    for (int sky = 0; sky < 2; ++sky) ASSERT_EQ(one.at(sky, p), four.at(sky, p));
}

}  // namespace
}  // namespace roxel

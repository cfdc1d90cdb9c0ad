#include "roxel/solve/daylight.h"

#include <gtest/gtest.h>

#include <cmath>

#include "roxel/base/error.h"
#include "roxel/sky/sky_picture.h"
#include "roxel/solve/cube_fixture.h"
#include "roxel/solve/scene.h"

namespace roxel {
namespace {

/// A dome of one colour all over, without a sun: a white horizontal surface below it has that colour.
NodeSky uniform_sky(double r, double g, double b) {
  NodeSky sky;
  sky.model = SkyModel::kUniform;
  const double rgb[3] = {r, g, b};
  for (int c = 0; c < 3; ++c) sky.channels[c].scale = rgb[c];
  return sky;
}

Daylight two_skies() { return {{uniform_sky(2, 4, 8), uniform_sky(1, 1, 1)}, {0, 1, 1, -1}, false}; }

TEST(LightOfViews, IsTheSkysLightOverItsGeometricMean) {
  const auto light = light_of_views(two_skies());
  ASSERT_EQ(light.size(), 4u);
  const double mean = std::cbrt(luminance(std::array<double, 3>{2, 4, 8}));  // of three views that have a sky
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(light[0][c], std::exp2(c + 1) / mean, 0.01 * light[0][c]);
    EXPECT_NEAR(light[1][c], 1 / mean, 0.01 / mean);
    EXPECT_EQ(light[1][c], light[2][c]);
    EXPECT_EQ(light[3][c], 1);
  }
}

TEST(LightOfViews, TheSunsDiscCounts) {
  Daylight daylight = two_skies();
  daylight.skies[1].sun_light = SunLight::kMeasured;
  daylight.skies[1].sun = Eigen::Vector3d::UnitZ();
  daylight.skies[1].sun_irradiance = Eigen::Vector3d::Constant(9 * M_PI);
  const auto without = light_of_views(two_skies()), with = light_of_views(daylight);
  EXPECT_NEAR(with[1][0] / with[0][0], 10 * without[1][0] / without[0][0], 0.05);
}

TEST(LightOfViews, TheMeanOfTheDomeIsAnotherWorth) {
  Daylight daylight = two_skies();
  daylight.skies[1].sun_light = SunLight::kMeasured;
  daylight.skies[1].sun_irradiance = Eigen::Vector3d::Constant(2 * M_PI);
  // Radiance 1 and a sun at the zenith: 1 + 2 on the horizontal, 1 + 1 in the mean over the dome.
  const auto horizontal = light_of_views(daylight), mean = light_of_views(daylight, DomeLight::kMean);
  EXPECT_NEAR(horizontal[1][0] / horizontal[0][0], 3.0 / 2, 0.02);
  EXPECT_NEAR(mean[1][0] / mean[0][0], 2.0 / 2, 0.02);
}

TEST(LightOfViews, NothingIsKnownWithoutASky) {
  EXPECT_TRUE(light_of_views({{NodeSky{}}, {0, 0}, false}).empty());
  EXPECT_TRUE(light_of_views({{}, {-1, -1}, false}).empty());
}

class ChooseLight : public testing::Test {
 protected:
  Scene scene_with(IlluminationChoice choice, Matching matching, const Daylight* daylight) const {
    ReconstructOptions options;
    options.illumination = choice;
    options.matching = matching;
    return survey(dataset_, fixture::cube_loader(), options, RunContext(1), daylight);
  }
  Dataset dataset_ = fixture::cube_dataset(4, 8);
  Daylight skies_ = two_skies();
};

TEST_F(ChooseLight, AutoTakesSkiesThatAreKnownAndThenComparesWithoutLocalLight) {
  const Scene known = scene_with(IlluminationChoice::kAuto, Matching::kAuto, &skies_);
  EXPECT_EQ(known.light.from, LightSource::kSky);
  EXPECT_TRUE(known.light.local_matching);
  EXPECT_EQ(known.light.of_views, light_of_views(skies_));
  const Scene unknown = scene_with(IlluminationChoice::kAuto, Matching::kAuto, nullptr);
  EXPECT_EQ(unknown.light.from, LightSource::kNone);
  EXPECT_FALSE(unknown.light.local_matching);
}

TEST_F(ChooseLight, OptionsAreObeyed) {
  EXPECT_EQ(scene_with(IlluminationChoice::kNone, Matching::kAuto, &skies_).light.from, LightSource::kNone);
  EXPECT_EQ(scene_with(IlluminationChoice::kGain, Matching::kAuto, &skies_).light.from, LightSource::kGain);
  EXPECT_FALSE(scene_with(IlluminationChoice::kSky, Matching::kCanonical, &skies_).light.local_matching);
  EXPECT_TRUE(scene_with(IlluminationChoice::kNone, Matching::kLocal, nullptr).light.local_matching);
  EXPECT_THROW(scene_with(IlluminationChoice::kSky, Matching::kAuto, nullptr), InvalidInput);
  EXPECT_THROW(scene_with(IlluminationChoice::kSkyNormal, Matching::kAuto, nullptr), InvalidInput);
  const Light by_normal = scene_with(IlluminationChoice::kSkyNormal, Matching::kAuto, &skies_).light;
  EXPECT_TRUE(by_normal.by_normal && by_normal.local_matching && by_normal.from == LightSource::kSky);
}

TEST_F(ChooseLight, MasksOfTheSkyLeaveTheRestOfTheHorizonToTheSurround) {
  const auto surround = [&](double half_side) {
    ReconstructOptions options;
    options.bounds = {-half_side, -half_side, -half_side, half_side, half_side, half_side};
    return survey(dataset_, fixture::cube_loader(std::array<float, 3>{0, 0, 0}, true), options, RunContext(1),
                  &skies_)
        .surround_count;
  };
  EXPECT_EQ(surround(0.8), 0);
  skies_.masks = true;
  EXPECT_GT(surround(0.8), 0);
  EXPECT_EQ(surround(4), 0);  // the cameras stand in the box
}

}  // namespace
}  // namespace roxel

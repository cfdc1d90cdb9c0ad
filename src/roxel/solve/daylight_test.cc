#include "roxel/solve/daylight.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <mutex>

#include "roxel/base/error.h"
#include "roxel/sky/sky_picture.h"
#include "roxel/solve/cube_fixture.h"
#include "roxel/solve/run_stages.h"
#include "roxel/solve/scene.h"

namespace roxel {
namespace {

/// A dome of one colour all over, whose sun is known not to shine: a white horizontal surface below it has
/// that colour.
NodeSky uniform_sky(double r, double g, double b) {
  NodeSky sky;
  sky.model = SkyModel::kUniform;
  sky.sun_source = SunSource::kTime;
  const double rgb[3] = {r, g, b};
  for (int c = 0; c < 3; ++c) sky.channels[c].scale = rgb[c];
  return sky;
}

Daylight two_skies() { return {{uniform_sky(2, 4, 8), uniform_sky(1, 1, 1)}, {0, 1, 1, -1}, {}}; }

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
  EXPECT_TRUE(light_of_views({{NodeSky{}}, {0, 0}, {}}).empty());
  EXPECT_TRUE(light_of_views({{}, {-1, -1}, {}}).empty());
}

/// From zenith to horizon alone: the sun is not known.
NodeSky gradation(double r, double g, double b, double a_of_shape, double b_of_shape) {
  NodeSky sky = uniform_sky(r, g, b);
  sky.name = "n05";
  sky.model = SkyModel::kGradation;
  sky.fallback = "sun not known";
  sky.sun_source = SunSource::kNone;
  for (PerezChannel& channel : sky.channels) channel.shape.a = a_of_shape, channel.shape.b = b_of_shape;
  return sky;
}

TEST(WhyNoLight, WithoutTheSunOnlyAnOvercastSkysLightIsWhole) {
  const double thick[2] = {4, -0.7}, clear[2] = {-1, -0.32};  // standard overcast, standard clear sky
  EXPECT_EQ(why_no_light(gradation(1, 1, 1.05, thick[0], thick[1])), "");
  EXPECT_EQ(why_no_light(gradation(0.4, 0.6, 1, thick[0], thick[1])), "sun not known");
  EXPECT_EQ(why_no_light(gradation(1, 1, 1, clear[0], clear[1])), "sun not known");
  NodeSky one_color = uniform_sky(1, 1, 1);
  EXPECT_EQ(why_no_light(one_color), "");
  one_color.sun_source = SunSource::kNone;
  EXPECT_EQ(why_no_light(one_color), "sun not known");
  NodeSky night;
  night.fallback = "night";
  EXPECT_EQ(why_no_light(night), "night");
}

TEST(WhyNoLight, IsCountedByViewsAndNamesNodes) {
  Daylight daylight = two_skies();
  EXPECT_EQ(reasons_without_light(daylight), "1 no sky fitted");
  daylight.skies.push_back(gradation(0.4, 0.6, 1, -1, -0.32));
  daylight.skies.emplace_back().fallback = "night";
  daylight.skies.back().name = "n03";
  daylight.sky_of_views = {0, 3, 2, 3};
  EXPECT_EQ(reasons_without_light(daylight), "2 night (n03), 1 sun not known (n05)");
  EXPECT_EQ(daylight.of_view(2), nullptr);
  const auto light = light_of_views(daylight);
  EXPECT_EQ(light[2], (std::array<float, 3>{1, 1, 1}));
  EXPECT_NE(light[0], light[2]);
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

TEST_F(ChooseLight, SaysOfHowManyViewsAndWhyNotOfTheOthers) {
  const Scene part = scene_with(IlluminationChoice::kSky, Matching::kAuto, &skies_);
  EXPECT_EQ(part.light.of_dome, (std::vector<std::uint8_t>{1, 1, 1, 0}));
  EXPECT_TRUE(part.light.has_gains() && part.light.is_gain(3) && !part.light.is_gain(2));
  EXPECT_THAT(part.warnings, testing::Contains(testing::HasSubstr("out of 3 of 4 views")));
  EXPECT_THAT(part.warnings, testing::Contains(testing::HasSubstr("1 no sky fitted")));
  EXPECT_THAT(part.notes, testing::Not(testing::Contains(testing::HasSubstr("each view's"))));
  skies_.sky_of_views.back() = 0;
  const Scene all = scene_with(IlluminationChoice::kSky, Matching::kAuto, &skies_);
  EXPECT_FALSE(all.light.has_gains());
  EXPECT_THAT(all.warnings, testing::Not(testing::Contains(testing::HasSubstr("views"))));
  EXPECT_THAT(all.notes, testing::Contains("light: that of each view's sky is divided out"));
}

TEST_F(ChooseLight, NamesWhyNoSkyIsKnown) {
  NodeSky night;
  night.name = "n00", night.fallback = "night";
  const Daylight dark{{night}, {0, 0, 0, 0}, {}};
  try {
    scene_with(IlluminationChoice::kSky, Matching::kAuto, &dark);
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("no photograph whose light is known: 4 night (n00)"));
  }
  EXPECT_THAT(scene_with(IlluminationChoice::kAuto, Matching::kAuto, &dark).warnings,
              testing::Contains(testing::HasSubstr("4 night (n00)")));
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
  skies_.sky_masked = {1, 1, 1, 1};
  EXPECT_GT(surround(0.8), 0);
  EXPECT_EQ(surround(4), 0);  // the cameras stand in the box
}

/// Mean opacity of the rays of views without a mask that pass the cube.
double opacity_beside_cube(const Dataset& dataset, const PhotographLoader& load, const Daylight& daylight) {
  ReconstructOptions options;
  options.bounds = {-0.8, -0.8, -0.8, 0.8, 0.8, 0.8};
  options.resolution = 24;
  options.levels = 1;
  options.passes = 6;
  options.fit_colors = false;
  options.empty_sky = false;                // it would empty what passes build
  options.surround = SurroundChoice::kOff;  // its voxels are not counted
  RunContext context(2);
  ReconstructHooks hooks;
  hooks.daylight = &daylight;
  const Reconstruction made = reconstruct(dataset, load, options, context, hooks);
  ViewStageOptions stages;
  stages.render = false;
  std::mutex mutex;
  double sum = 0;
  int count = 0;
  for_each_view_result(dataset, load, made, options, stages, context, [&](const ViewResult& result) {
    if (daylight.sky_masked[result.view_idx]) return;
    const std::lock_guard lock(mutex);
    const PinholeCamera& camera = dataset.views[result.view_idx].camera;
    for (int y = 0; y < camera.intrinsics.height; ++y)
      for (int x = 0; x < camera.intrinsics.width; ++x)
        if (!fixture::CubeWorld::hit(camera.ray(x + 0.5, y + 0.5)))
          sum += *result.depth.opacity.pixel(x, y), ++count;
  });
  return sum / count;
}

// Every third photograph was taken at night, before a background that nothing else knows.
TEST(NodesWithoutASky, DoNotBuildTheirSky) {
  const Dataset dataset = fixture::cube_dataset(12, 32);
  Daylight daylight = two_skies();
  daylight.skies.emplace_back().fallback = "night";
  daylight.sky_of_views.clear();
  for (int v = 0; v < 12; ++v) {
    daylight.sky_of_views.push_back(v % 3 == 0 ? 2 : 1);
    daylight.sky_masked.push_back(v % 3 != 0);
  }
  const auto loader = [&](bool night_has_masks) {
    return [&, night_has_masks](const View& view) {
      const bool night = !daylight.sky_masked[&view - dataset.views.data()];
      Photograph photo =
          fixture::CubeWorld::photograph(view.camera, std::array<float, 3>{0.3f, 0.4f, 0.6f}, true);
      if (night)
        for (float& value : photo.rgb.data()) value *= 0.3f;
      if (night) {
        photo.foreground = night_has_masks ? Mask(32, 32) : Mask();
        return photo;
      }
      photo.sky = photo.foreground;
      for (std::uint8_t& value : photo.sky.data()) value = static_cast<std::uint8_t>(255 - value);
      return photo;
    };
  };
  // A mask that calls all of a photograph object has voxels built before its sky: this test can fail.
  const double all_object = opacity_beside_cube(dataset, loader(true), daylight);
  const double unknown = opacity_beside_cube(dataset, loader(false), daylight);
  EXPECT_GT(all_object, 0.9);
  EXPECT_LT(unknown, 0.3) << all_object;
}

}  // namespace
}  // namespace roxel

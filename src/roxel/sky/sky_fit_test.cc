#include "roxel/sky/sky_fit.h"

#include <gtest/gtest.h>

#include "roxel/sky/sky_fixture.h"

namespace roxel {
namespace {

double dome_difference(const NodeSky& ours, const NodeSky& truth) {
  const FacetSphere sphere(3);
  double sum = 0;
  int count = 0;
  for (int f = 0; f < sphere.count(); ++f) {
    if (sphere.centre(f).z() < 0.05) continue;
    sum +=
        (ours.radiance_in_sky(sphere.centre(f)).array() / truth.radiance_in_sky(sphere.centre(f)).array() - 1)
            .abs()
            .mean();
    ++count;
  }
  return sum / count;
}

/// Intersection over union of a mask's sky with the truth.
double iou(const Mask& sky, const Mask& surface) {
  double both = 0, either = 0;
  for (std::size_t i = 0; i < sky.data().size(); ++i) {
    const bool ours = sky.data()[i] >= 128, truth = surface.data()[i] < 128;
    both += ours && truth, either += ours || truth;
  }
  return both / either;
}

SkyTask noon() {
  SkyTask task;
  task.time_utc_s = 1061484600;  // 2003-08-21T16:50:00Z
  task.latitude_deg = 42.36;
  task.longitude_deg = -71.09;
  return task;
}

TEST(FitSky, FindsAClearSkyOverWallsThatAreBrighterThanIt) {
  const NodeSky truth = clear_sky();
  Mask surface;
  Square square;
  square.noise = 0.01f;
  const SkyPicture picture = panorama_of(truth, square, &surface);
  const SkyFit fit = fit_one(picture);
  EXPECT_EQ(fit.sky.model, SkyModel::kPerez);
  EXPECT_EQ(fit.sky.fallback, "");
  EXPECT_TRUE(fit.masks.red_blue_used);
  EXPECT_FALSE(fit.masks.luminance_used);
  EXPECT_LT(fit.sky.mean_error, 0.02);
  EXPECT_LT(dome_difference(fit.sky, truth), 0.05);
  EXPECT_EQ(fit.sky.sun_source, SunSource::kImages);
  EXPECT_EQ(fit.sky.sun_light, SunLight::kMeasured);
  EXPECT_NEAR(fit.sky.sun_irradiance[1] / truth.sun_irradiance[1], 1, 0.05);
  EXPECT_GT(iou(soft_sky_mask(picture, fit), surface), 0.97);
}

TEST(FitSky, FindsAGreyOvercastSkyByItsLuminance) {
  const NodeSky truth = overcast_sky();
  Mask surface;
  Square square;
  square.wall = 0.05f, square.noise = 0.02f;
  const SkyPicture picture = panorama_of(truth, square, &surface);
  const SkyFit fit = fit_one(picture, {}, noon());
  EXPECT_EQ(fit.sky.model, SkyModel::kPerez);
  EXPECT_FALSE(fit.masks.red_blue_used) << "red over blue is 1 here";
  EXPECT_TRUE(fit.masks.luminance_used);
  EXPECT_NE(fit.masks.reason.find("red over blue left out"), std::string::npos) << fit.masks.reason;
  EXPECT_LT(dome_difference(fit.sky, truth), 0.05);
  EXPECT_EQ(fit.sky.sun_light, SunLight::kNone);
  EXPECT_GT(iou(soft_sky_mask(picture, fit), surface), 0.97);
}

TEST(FitSky, WindowsAreNoSky) {
  Square square;
  square.window = true;
  square.roof_deg = 20;
  const SkyPicture picture = panorama_of(clear_sky(), square);
  const SkyFit fit = fit_one(picture);
  const Mask mask = soft_sky_mask(picture, fit);
  ASSERT_TRUE(fit.sky.has_light());
  EXPECT_EQ(mask.at(180, 82), 0);
  EXPECT_GT(mask.at(180, 40), 200);
}

TEST(FitSky, TheSunsRegionOverridesTheMasks) {
  const NodeSky truth = clear_sky();
  const SkyPicture picture = panorama_of(truth, {});
  const SkyFit fit = fit_one(picture);
  const int in_sun = fit.light.sphere->facet_at(truth.sun);
  EXPECT_TRUE(fit.masks.near_sun[in_sun]);
  EXPECT_FALSE(fit.used[in_sun]);
  const auto at = picture.rays.position(truth.sun);
  EXPECT_EQ(soft_sky_mask(picture, fit).at(static_cast<int>(at->x()), static_cast<int>(at->y())), 255);
}

TEST(FitSky, WarnsWhereTimeAndImagesDisagreeOnTheSun) {
  const SkyFit wrong = fit_one(panorama_of(clear_sky(20, 50), {}), {}, noon());
  ASSERT_EQ(wrong.warnings.size(), 1u);
  EXPECT_NE(wrong.warnings[0].find("degrees apart"), std::string::npos);
  EXPECT_EQ(wrong.sky.sun_source, SunSource::kTime);
  ASSERT_TRUE(wrong.sky.sun_by_images && wrong.sky.sun_by_time);
  const SunPosition sun = sun_position(*noon().time_utc_s, *noon().latitude_deg, *noon().longitude_deg);
  EXPECT_TRUE(
      fit_one(panorama_of(clear_sky(sun.azimuth_deg, sun.elevation_deg), {}), {}, noon()).warnings.empty());
}

TEST(FitSky, ASunByHandComesFirst) {
  SkyFitOptions options;
  options.sun = SunPosition{77, 33};
  const SkyFit fit = fit_one(panorama_of(clear_sky(), {}), options, noon());
  EXPECT_EQ(fit.sky.sun_source, SunSource::kGiven);
  EXPECT_LT((fit.sky.sun - sun_direction({77, 33})).norm(), 1e-9);
}

TEST(FitSky, MasksByHandAloneSayWhatIsSky) {
  SkyPicture picture = panorama_of(clear_sky(), {});
  picture.known_sky = Mask(360, 180, 0);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 360; ++x) picture.known_sky.at(x, y) = 255;
  const SkyFit fit = fit_one(picture);
  EXPECT_EQ(fit.masks.reason, "masks by hand say what is sky");
  for (int f = 0; f < fit.light.sphere->count(); ++f)
    EXPECT_TRUE(!fit.masks.sky[f] || fit.light.sphere->centre(f).z() > std::sin(48 * kDegree));
  EXPECT_GT(std::count(fit.masks.sky.begin(), fit.masks.sky.end(), 1), 100);
}

/// A clear sky half covered by bright grey cloud with a soft texture, and what a perfect volume lets through.
SkyPicture clouded(Mask* surface) {
  Square square;
  square.disc = false;
  SkyPicture picture = panorama_of(clear_sky(), square, surface);
  picture.open = Mask(360, 180, 0);
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 360; ++x) {
      if (surface->at(x, y) < 128) picture.open.at(x, y) = 255;
      if (surface->at(x, y) >= 128 || y < 25 || (x / 40) % 2 == 0) continue;
      for (int c = 0; c < 3; ++c) picture.rgb.pixel(x, y)[c] = 0.4f * (1 + 0.05f * unrest(x / 3, y / 3));
    }
  return picture;
}

TEST(FitSky, WhatAVolumeLeavesUnexplainedMayBeCloud) {
  Mask surface;
  const SkyPicture seen = clouded(&surface);
  SkyPicture alone = seen;
  alone.open = {};
  SkyFitOptions options;
  options.facet_level = 4;  // enough, and quick
  const SkyFit before = fit_one(alone, options), after = fit_one(seen, options);
  const double iou_before = iou(soft_sky_mask(alone, before), surface),
               iou_after = iou(soft_sky_mask(seen, after), surface);
  EXPECT_LT(iou_before, 0.6);
  EXPECT_GT(iou_after, 0.8);  // facets of 7 degrees lose the edges
}

TEST(FitSky, WallsDoNotBecomeSkyBecauseAVolumeHasAHole) {
  Mask surface;
  SkyPicture picture = panorama_of(clear_sky(), {}, &surface);
  picture.open = Mask(360, 180, 255);
  SkyFitOptions options;
  options.facet_level = 4;
  EXPECT_GT(iou(soft_sky_mask(picture, fit_one(picture, options)), surface), 0.95);
}

TEST(FitSky, ResidualFunctionsTakeUpWhatTheModelCannot) {
  NodeSky truth = clear_sky();
  truth.residual_order = 2;
  for (auto& r : truth.residual) r = {0, 0, 0, 0.15, 0, 0.1, 0, 0, -0.1};
  const SkyPicture picture = panorama_of(truth, {});
  SkyFitOptions options;
  const SkyFit plain = fit_one(picture, options);
  options.residual_order = 3;
  const SkyFit richer = fit_one(picture, options);
  EXPECT_EQ(richer.sky.residual_order, 3);
  EXPECT_LT(richer.sky.mean_error, 0.6 * plain.sky.mean_error);
}

TEST(FitSky, NightHasNoLight) {
  SkyTask task = noon();
  *task.time_utc_s += 12 * 3600;
  const SkyFit fit = fit_one(panorama_of(overcast_sky(), {}), {}, task);
  EXPECT_EQ(fit.sky.model, SkyModel::kNone);
  EXPECT_EQ(fit.sky.fallback, "night");
  EXPECT_EQ(SkyLight(fit.sky).horizontal_irradiance(Disc::kWith), Eigen::Vector3d::Zero());
}

TEST(FitSky, WithoutSkyInViewThereIsAName) {
  Square square;
  square.roof_deg = 95;
  const SkyPicture picture = panorama_of(clear_sky(), square);
  const SkyFit fit = fit_one(picture);
  EXPECT_EQ(fit.sky.model, SkyModel::kNone);
  EXPECT_EQ(fit.sky.fallback, "no sky in view");
  const Mask mask = soft_sky_mask(picture, fit);
  EXPECT_EQ(*std::max_element(mask.data().begin(), mask.data().end()), 0);
}

TEST(FitSky, ASkyThatClipsHasAName) {
  SkyPicture picture = panorama_of(overcast_sky(), {});
  for (float& value : picture.rgb.data()) value = std::min(1.0f, 20 * value);
  picture.clip = clip_level(picture.rgb);
  const SkyFit fit = fit_one(picture, {}, noon());
  EXPECT_EQ(fit.sky.model, SkyModel::kNone);
  EXPECT_EQ(fit.sky.fallback, "clipped");
  const Mask mask = soft_sky_mask(picture, fit);
  EXPECT_EQ(mask.at(100, 20), 255);
  EXPECT_EQ(mask.at(100, 120), 0) << "below the horizon";
}

TEST(FitSky, AnUnknownSunLeavesGradation) {
  Square square;
  square.wall = 0.05f;
  const SkyFit fit = fit_one(panorama_of(overcast_sky(), square));
  EXPECT_EQ(fit.sky.model, SkyModel::kGradation);
  EXPECT_EQ(fit.sky.fallback, "sun not known");
  EXPECT_EQ(fit.sky.channels[0].shape.c, 0);
  EXPECT_LT(dome_difference(fit.sky, overcast_sky()), 0.03);
}

/// One picture of 20 x 15 degrees, looking up at an angle.
SkyPicture narrow_picture(const NodeSky& sky) {
  PinholeCamera camera;
  camera.intrinsics = {120, 90, 340, 340, 60, 45, 0};
  camera.pose.rotation << 1, 0, 0, 0, 0.8, -0.6, 0, 0.6, 0.8;
  SkyPicture picture{Image(120, 90, 3), {}, {}, PixelRays(camera, Eigen::Matrix3d::Identity())};
  for (int y = 0; y < 90; ++y)
    for (int x = 0; x < 120; ++x) {
      const Eigen::Vector3f seen =
          sky.radiance_in_sky(picture.rays.direction(x + 0.5, y + 0.5)).cast<float>();
      std::copy_n(seen.data(), 3, picture.rgb.pixel(x, y));
    }
  for (int y = 60; y < 90; ++y)
    for (int x = 0; x < 120; ++x) std::fill_n(picture.rgb.pixel(x, y), 3, 0.02f * (1.2f + unrest(x, y)));
  picture.clip = clip_level(picture.rgb);
  return picture;
}

TEST(FitSky, OneNarrowImageGetsAPublishedSkyOrOneColour) {
  const NodeSky truth = clear_sky(181.2, 59.7);
  const SkyFit placed = fit_one(narrow_picture(truth), {}, noon());
  EXPECT_EQ(placed.sky.model, SkyModel::kPublished);
  EXPECT_EQ(placed.sky.fallback, "little sky in view");
  const SkyFit alone = fit_one(narrow_picture(truth));
  EXPECT_EQ(alone.sky.model, SkyModel::kUniform);
  const Eigen::Vector3d ahead(0, 0.8, 0.6);
  EXPECT_NEAR(alone.sky.radiance_in_sky(ahead)[2] / truth.radiance_in_sky(ahead)[2], 1, 0.2);
}

TEST(FitSky, IsTheSameEveryTime) {
  const SkyPicture picture = panorama_of(clear_sky(), {});
  const SkyFit a = fit_one(picture), b = fit_one(picture);
  EXPECT_EQ(a.sky.channels, b.sky.channels);
  EXPECT_EQ(a.used, b.used);
}

}  // namespace
}  // namespace roxel

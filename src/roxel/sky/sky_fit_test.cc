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

/// Where a fit to a wrong sun takes all rounds: enough for what is warned of.
SkyFitOptions quick() {
  SkyFitOptions options;
  options.facet_level = 4;
  return options;
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

bool warns(const SkyFit& fit, const std::string& text) {
  return std::any_of(fit.warnings.begin(), fit.warnings.end(),
                     [&](const std::string& w) { return w.find(text) != std::string::npos; });
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

// Haze darkens the sky in a gap between walls by more than any model has, bit by bit; at its bottom is
// something smooth that is a sixth darker still.
TEST(FitSky, SkyIsFollowedDownAGapAsFarAsItChangesBitByBit) {
  Square square;
  square.roof_deg = 25;
  SkyPicture picture = panorama_of(clear_sky(), square);
  constexpr int kLeft = 20, kRight = 28, kTop = 65, kBottom = 84;
  const NodeSky sky = clear_sky();
  for (int y = kTop; y < 90; ++y)
    for (int x = kLeft; x < kRight; ++x) {
      const Eigen::Vector3d light = sky.radiance_in_sky(picture.rays.direction(x + 0.5, y + 0.5));
      const double haze = std::exp(-0.03 * (y - kTop)) * (y < kBottom ? 1 : 0.85);
      for (int c = 0; c < 3; ++c) picture.rgb.pixel(x, y)[c] = static_cast<float>(haze * light[c]);
    }
  const Mask mask = soft_sky_mask(picture, fit_one(picture));
  for (int y = kTop; y < 90; ++y) {
    EXPECT_EQ(mask.at(24, y) > 200, y < kBottom) << y;
    EXPECT_LT(mask.at(kLeft - 3, y), 10);
    EXPECT_LT(mask.at(kRight + 2, y), 10);
  }
}

// What darkens bit by bit may be a blurred outline: a mask follows it no further than to a third.
TEST(FitSky, SkyIsNotFollowedIntoTheDark) {
  Square square;
  square.roof_deg = 25;
  SkyPicture picture = panorama_of(clear_sky(), square);
  const NodeSky sky = clear_sky();
  constexpr int kTop = 65;
  for (int y = kTop; y < 90; ++y)
    for (int x = 20; x < 28; ++x) {
      const Eigen::Vector3d light = sky.radiance_in_sky(picture.rays.direction(x + 0.5, y + 0.5));
      for (int c = 0; c < 3; ++c)
        picture.rgb.pixel(x, y)[c] = static_cast<float>(std::exp(-0.05 * (y - kTop)) * light[c]);
    }
  const Mask mask = soft_sky_mask(picture, fit_one(picture));
  EXPECT_GT(mask.at(24, kTop + 18), 200);  // 0.41 of the sky
  EXPECT_EQ(mask.at(24, 89), 0);           // 0.30
}

// A large photograph, pixels of 0.02 degrees, of the edge of a smooth wall that is nearly as bright as the
// sky, blurred over twenty of them: bit by bit it leads into the wall.
TEST(FitSky, ABlurredOutlineOfALargePhotographIsNoWayIntoAWall) {
  const NodeSky sky = clear_sky();
  const SkyFit fit = fit_one(panorama_of(sky, {}));
  PinholeCamera camera;
  constexpr int kSide = 240;
  constexpr double kFocal = kSide / 0.084;
  camera.intrinsics = {kSide, kSide, kFocal, kFocal, kSide / 2.0, kSide / 2.0, 0};
  const double edge = 17 * kDegree;
  camera.pose.rotation << 1, 0, 0, 0, std::sin(edge), -std::cos(edge), 0, std::cos(edge), std::sin(edge);
  SkyPicture picture{Image(kSide, kSide, 3), {}, {}, PixelRays(camera, Eigen::Matrix3d::Identity())};
  ASSERT_NEAR(picture.rays.pixel_angle() / kDegree, 0.02, 0.001);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const Eigen::Vector3d direction = picture.rays.direction(x + 0.5, y + 0.5);
      const double up = (std::asin(direction.z()) - edge) / kDegree;
      const double open = 1 / (1 + std::exp(-up / 0.08));
      const Eigen::Vector3d light = sky.radiance_in_sky(direction);
      for (int c = 0; c < 3; ++c)
        picture.rgb.pixel(x, y)[c] = static_cast<float>(open * light[c] + (1 - open) * 0.8 * light[2 - c]);
    }
  const Mask mask = soft_sky_mask(picture, fit);
  EXPECT_GT(mask.at(kSide / 2, 20), 200);
  for (int y = kSide / 2 + 20; y < kSide; ++y) EXPECT_EQ(mask.at(kSide / 2, y), 0) << y;
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
  const SkyFit wrong = fit_one(panorama_of(clear_sky(20, 50), {}), quick(), noon());
  EXPECT_TRUE(warns(wrong, "degrees apart"));
  EXPECT_EQ(wrong.sky.sun_source, SunSource::kTime);
  ASSERT_TRUE(wrong.sky.sun_by_images && wrong.sky.sun_by_time);
  const SunPosition sun = sun_position(*noon().time_utc_s, *noon().latitude_deg, *noon().longitude_deg);
  EXPECT_TRUE(
      fit_one(panorama_of(clear_sky(sun.azimuth_deg, sun.elevation_deg), {}), {}, noon()).warnings.empty());
}

TEST(FitSky, ASunByHandComesFirst) {
  SkyFitOptions options = quick();
  options.sun = SunPosition{77, 33};
  const SkyFit fit = fit_one(panorama_of(clear_sky(), {}), options, noon());
  EXPECT_EQ(fit.sky.sun_source, SunSource::kGiven);
  EXPECT_LT((fit.sky.sun - sun_direction({77, 33})).norm(), 1e-9);
}

TEST(FitSky, ASunByHandSaysWhetherItIsNight) {
  SkyTask night = noon();
  *night.time_utc_s += 12 * 3600;
  SkyFitOptions options;
  options.sun = SunPosition{150, 40};
  EXPECT_EQ(fit_one(panorama_of(clear_sky(), {}), options, night).sky.model, SkyModel::kPerez);
  options.sun = SunPosition{150, -20};
  for (const SkyTask& task : {SkyTask{}, noon()}) {
    const SkyFit fit = fit_one(panorama_of(clear_sky(), {}), options, task);
    EXPECT_EQ(fit.sky.model, SkyModel::kNone);
    EXPECT_EQ(fit.sky.fallback, "night");
  }
}

TEST(FitSky, MasksByHandAloneSayWhatIsSky) {
  Square square;
  square.noise = 0.3f;  // of the variance mask
  SkyPicture picture = panorama_of(clear_sky(), square);
  picture.known_sky = Mask(360, 180, 0);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 360; ++x) picture.known_sky.at(x, y) = 255;
  const SkyFit fit = fit_one(picture);
  EXPECT_EQ(fit.masks.reason, "masks by hand say what is sky");
  int marked = 0, used = 0;
  for (int f = 0; f < fit.light.sphere->count(); ++f) {
    if (fit.used[f]) {
      EXPECT_GT(fit.light.sphere->centre(f).z(), std::sin(48 * kDegree)) << "none beyond";
    }
    if (fit.light.sphere->centre(f).z() < std::sin(54 * kDegree) || fit.masks.near_sun[f]) continue;
    ++marked, used += fit.used[f];
  }
  EXPECT_EQ(used, marked) << "and none less";
  EXPECT_TRUE(fit.warnings.empty());
  picture.known_sky = Mask(360, 180, 0);
  EXPECT_EQ(fit_one(picture).sky.fallback, "no sky in view");
}

TEST(FitSky, WarnsWhereOnlySomeImagesHaveMasksByHand) {
  const SkyPicture without = panorama_of(clear_sky(), {});
  SkyPicture with = without;
  with.known_sky = Mask(360, 180, 0);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 360; ++x) with.known_sky.at(x, y) = 255;
  SkyFitOptions options;
  options.facet_level = 4;
  SkyTask task;
  task.views = {"a", "b"};
  const SkyFit fit = fit_sky(
      task, [&](int i) { return i == 0 ? with : without; }, options);
  ASSERT_EQ(fit.warnings.size(), 1u);
  EXPECT_NE(fit.warnings[0].find("for 1 of 2 images"), std::string::npos) << fit.warnings[0];
  EXPECT_GT(fit.sky.sky_share, 0.2);
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
  EXPECT_LT(iou_before, 0.75);
  EXPECT_GT(iou_after, 0.8);  // facets of 7 degrees lose the edges
}

/// Bright round clouds of one colour with sharp edges, and below each a smooth part of the wall, of that
/// colour, too, that a volume lacks.
SkyPicture with_sharp_clouds(Mask* surface) {
  Square square;
  square.disc = false;
  SkyPicture picture = panorama_of(clear_sky(), square, surface);
  picture.open = Mask(360, 180, 0);
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 360; ++x) {
      const bool sky = surface->at(x, y) < 128, hole = !sky && std::hypot(x % 120 - 60, y - 82) < 6;
      if (sky || hole) picture.open.at(x, y) = 255;
      if (hole || (sky && y > 12 && std::hypot(x % 120 - 60, y - 40) < 16))
        for (int c = 0; c < 3; ++c) picture.rgb.pixel(x, y)[c] = 0.5f;
    }
  return picture;
}

TEST(FitSky, CloudsWithSharpEdgesAreSkyWhereAVolumeKnowsOfNothingAround) {
  Mask surface;
  const SkyPicture seen = with_sharp_clouds(&surface);
  SkyPicture alone = seen;
  alone.open = {};
  SkyFitOptions options;
  options.facet_level = 5;
  EXPECT_LT(iou(soft_sky_mask(alone, fit_one(alone, options)), surface), 0.86);
  const Mask mask = soft_sky_mask(seen, fit_one(seen, options));
  EXPECT_GT(iou(mask, surface), 0.93);
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 360; ++x)
      if (surface.at(x, y) == 255 && seen.open.at(x, y) == 255) {
        ASSERT_EQ(mask.at(x, y), 0) << "a hole in the wall: " << x << " " << y;
      }
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

/// As a camera with 8 bits shows it, from a factor of exposure on.
SkyPicture exposed(SkyPicture picture, float gain) {
  for (float& value : picture.rgb.data()) value = std::round(255 * std::min(1.0f, gain * value)) / 255;
  picture.clip = clip_level(picture.rgb);
  return picture;
}

TEST(FitSky, ASkyThatClipsHasANameAndItsMaskThoughWallsDoNotClip) {
  Mask surface;
  Square square;  // smooth facades and windows are what passes for sky here
  square.wall = 0.02f, square.window = true;
  const SkyPicture picture = panorama_of(overcast_sky(), square, &surface);
  for (const float gain : {1.0f, 6.0f, 7.0f, 8.0f, 10.0f, 14.0f, 20.0f, 30.0f}) {
    SCOPED_TRACE(gain);
    const SkyPicture seen = exposed(picture, gain);  // the zenith clips from 6.7, the horizon from 16
    const SkyFit fit = fit_one(seen, {}, noon());
    EXPECT_GT(iou(soft_sky_mask(seen, fit), surface), 0.95);
    EXPECT_EQ(fit.sky.sun_light, SunLight::kNone) << "no sun is made up";
    const bool most = fit.sky.clipped_share > fit.sky.sky_share;
    EXPECT_EQ(fit.sky.fallback, most ? "clipped" : "");
    EXPECT_EQ(fit.sky.model, most ? SkyModel::kNone : SkyModel::kPerez);
    EXPECT_EQ(warns(fit, "of the dome is sky that clips"), gain > 6);
    EXPECT_TRUE(gain > 6 || !most);
    EXPECT_TRUE(gain < 14 || most);
  }
}

TEST(FitSky, SunlitWallsThatClipAreNoSky) {
  Mask surface;
  Square square;
  square.wall = 1.5f;
  const SkyPicture picture = panorama_of(clear_sky(181.19, 59.73), square, &surface);
  for (const float gain : {1.0f, 2.0f, 3.0f}) {
    SCOPED_TRACE(gain);
    const SkyPicture seen = exposed(picture, gain);
    const SkyFit fit = fit_one(seen, {}, noon());
    EXPECT_EQ(fit.sky.model, SkyModel::kPerez);
    EXPECT_GT(iou(soft_sky_mask(seen, fit), surface), 0.95);
    EXPECT_EQ(fit.sky.sun_light, SunLight::kEstimated);
    EXPECT_GT(fit.sky.sun_relative_sigma, 0.3);
    EXPECT_TRUE(warns(fit, "sun's light is estimated"));
  }
}

TEST(FitSky, WarnsOfAWrongTimeInPhotographsToo) {
  const SkyFit wrong = fit_one(exposed(panorama_of(clear_sky(60, 35), {}), 1), {}, noon());
  EXPECT_TRUE(warns(wrong, "degrees apart"));
  EXPECT_EQ(wrong.sky.sun_light, SunLight::kEstimated) << "no sun there does not say that none shines";
  const SunPosition sun = sun_position(*noon().time_utc_s, *noon().latitude_deg, *noon().longitude_deg);
  EXPECT_FALSE(
      warns(fit_one(exposed(panorama_of(clear_sky(sun.azimuth_deg, sun.elevation_deg), {}), 1), {}, noon()),
            "apart"));
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

/// A wall of smooth white around a direction, as sunlit plaster is.
SkyPicture with_white_wall(SkyPicture picture, const SunPosition& at, double radius_deg) {
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 360; ++x)
      if (picture.rays.direction(x + 0.5, y + 0.5).dot(sun_direction(at)) > std::cos(radius_deg * kDegree))
        std::fill_n(picture.rgb.pixel(x, y), 3, 1.5f);
  return picture;
}

TEST(FitSky, InPhotographsTheSunIsWhatGlaresAmidSkyAndNoWall) {
  const NodeSky truth = clear_sky();
  const SkyPicture picture = with_white_wall(panorama_of(truth, {}), {330, 8}, 6);
  for (const float gain : {1.0f, 2.5f}) {
    SCOPED_TRACE(gain);  // the sun's own glare is smaller than the wall, and wider
    const SkyFit fit = fit_one(exposed(picture, gain));
    ASSERT_EQ(fit.sky.sun_source, SunSource::kImages);
    EXPECT_GT(fit.sky.sun.dot(truth.sun), std::cos(4 * kDegree));
    EXPECT_EQ(fit.sky.sun_light, SunLight::kEstimated);
  }
}

TEST(FitSky, AWallThatClipsIsNoSunWhereNoneIsInView) {
  Square square;
  square.disc = false, square.wall = 0.02f;
  const SkyPicture picture = with_white_wall(panorama_of(overcast_sky(), square), {330, 8}, 5);
  const SkyFit fit = fit_one(exposed(picture, 1));
  EXPECT_EQ(fit.sky.sun_source, SunSource::kNone);
  EXPECT_FALSE(fit.sky.sun_by_images);
  EXPECT_EQ(fit.sky.fallback, "sun not known");
  EXPECT_TRUE(warns(fit, "the sun is not known"));
  const SkyFit timed = fit_one(exposed(picture, 1), {}, noon());
  EXPECT_FALSE(timed.sky.sun_by_images);
  EXPECT_FALSE(warns(timed, "apart"));
}

TEST(FitSky, ASpotInALittleSkyIsNoSun) {
  SkyPicture picture = narrow_picture(clear_sky(181.2, 59.7));
  for (int y = 30; y < 34; ++y)
    for (int x = 50; x < 54; ++x) std::fill_n(picture.rgb.pixel(x, y), 3, 4.0f);
  const SkyFit fit = fit_one(exposed(picture, 1));
  EXPECT_EQ(fit.sky.sun_source, SunSource::kNone);
  EXPECT_EQ(fit.sky.model, SkyModel::kUniform);
}

TEST(FitSky, WarnsOfANightInWhichTheSunShines) {
  SkyTask night = noon();
  *night.time_utc_s += 12 * 3600;
  const SkyPicture day = panorama_of(clear_sky(), {});
  for (const SkyPicture& seen : {day, exposed(day, 1)}) {
    const SkyFit fit = fit_one(seen, {}, night);
    EXPECT_EQ(fit.sky.fallback, "night");
    EXPECT_TRUE(warns(fit, "it is night by time"));
  }
  SkyFitOptions below;
  below.sun = SunPosition{10, -30};
  EXPECT_TRUE(warns(fit_one(day, below), "it is night by hand"));
  Square lamp;  // as bright as a sun, beside a black sky
  lamp.disc = false;
  SkyPicture dark = panorama_of(overcast_sky(), lamp);
  for (float& value : dark.rgb.data()) value *= 1e-3f;
  dark = with_white_wall(dark, {330, 20}, 2);
  EXPECT_TRUE(fit_one(dark, {}, night).warnings.empty());
}

TEST(FitSky, AReflectionIsNoSecondSunWhereTheFirstIsSeen) {
  SkyPicture picture = panorama_of(clear_sky(181.19, 59.73), {});
  for (int y = 80; y < 83; ++y)
    for (int x = 20; x < 23; ++x)
      std::fill_n(picture.rgb.pixel(x, y), 3, 2000.0f + static_cast<float>(x * y));
  EXPECT_FALSE(warns(fit_one(picture, {}, noon()), "apart"));
  for (int y = 0; y < 60; ++y)  // a wall where the sun should be
    for (int x = 330; x < 390; ++x)
      std::fill_n(picture.rgb.pixel(x % 360, y), 3, 0.3f * (1 + 0.5f * unrest(x, y)));
  EXPECT_TRUE(warns(fit_one(picture, {}, noon()), "apart"));
}

TEST(FitSky, WarnsOfAClearSkyWithoutTheSunWhereItShouldBe) {
  Square square;
  square.disc = false;
  EXPECT_TRUE(warns(fit_one(panorama_of(clear_sky(40, 50), square), quick(), noon()), "no sun is there"));
  square.wall = 0.02f;
  EXPECT_FALSE(warns(fit_one(panorama_of(overcast_sky(), square), {}, noon()), "no sun is there"));
}

TEST(FitSky, SunlightThatNoImageShowsIsEstimatedUnderClearSkiesAlone) {
  // The sun stands behind a wall.
  const NodeSky truth = clear_sky(181.19, 59.73);
  Square square;
  square.disc = false;
  const auto hidden = [&](const NodeSky& sky) {
    SkyPicture picture = panorama_of(sky, square);
    for (int y = 0; y < 180; ++y)
      for (int x = 0; x < 360; ++x)
        if (picture.rays.direction(x + 0.5, y + 0.5).dot(truth.sun) > std::cos(15 * kDegree))
          std::fill_n(picture.rgb.pixel(x, y), 3, 0.02f * (1 + 0.5f * unrest(x, y)));
    return picture;
  };
  const SkyFit clear = fit_one(hidden(truth), {}, noon());
  EXPECT_EQ(clear.sky.sun_light, SunLight::kEstimated);
  EXPECT_TRUE(warns(clear, "no image shows its disc"));
  const double ratio = luminance(clear.sky.sun_irradiance) /
                       luminance(SkyLight(clear.sky).horizontal_irradiance(Disc::kWithout));
  // [IES84] at 59.7 degrees: 99 981 lx over 15 204 lx; haze as fitted against 0.31.
  EXPECT_NEAR(clear.sky.channels[1].shape.b, -0.23, 0.03);
  EXPECT_NEAR(ratio, 99981.0 / 15204 * std::pow(0.31 / -clear.sky.channels[1].shape.b, 1.3), 0.01);
  square.wall = 0.02f;
  EXPECT_EQ(fit_one(hidden(overcast_sky()), {}, noon()).sky.sun_light, SunLight::kNone);
}

TEST(FitSky, WhatCanBeDecidedGrowsWithTheFacets) {
  // A net over the sky but for a hole of 20 degrees: its meshes wait for the fit, and then are most of it.
  SkyPicture picture = panorama_of(clear_sky(), {});
  const Eigen::Vector3d hole = sun_direction({330, 50});
  for (int y = 0; y < 75; ++y)
    for (int x = 0; x < 360; ++x)
      if ((x % 6 == 0 || y % 6 == 0) &&
          picture.rays.direction(x + 0.5, y + 0.5).dot(hole) < std::cos(10 * kDegree))
        for (int c = 0; c < 3; ++c) picture.rgb.pixel(x, y)[c] *= 0.3f;
  SkyTask task;
  task.views = {"a"};
  const SkyFit fit = fit_sky(task, [&](int) { return picture; }, {});
  double sure = 0;
  for (int f = 0; f < fit.light.sphere->count(); ++f)
    if (fit.masks.sky[f]) sure += fit.light.sphere->solid_angle(f) / (2 * kPi);
  ASSERT_LT(sure, 0.03);
  EXPECT_GT(fit.sky.sky_share, 0.06);
  EXPECT_EQ(fit.sky.model, SkyModel::kPerez);
  EXPECT_EQ(fit.sky.fallback, "");
  EXPECT_LT(dome_difference(fit.sky, clear_sky()), 0.1);
}

TEST(FitSky, SaysHowMuchOfWhatLooksLikeSkyItCouldUse) {
  const SkyFit plain = fit_one(panorama_of(clear_sky(), {}));
  EXPECT_GT(plain.sky.inlier_share, 0.95);
  // A quarter of the sky, as bright as the rest along its edges, is not as the model has it.
  SkyPicture odd = panorama_of(clear_sky(), {});
  for (int y = 0; y < 75; ++y)
    for (int x = 0; x < 90; ++x)
      for (int c = 0; c < 3; ++c)
        odd.rgb.pixel(x, y)[c] *=
            1 + 0.8f * static_cast<float>(std::sin(kPi * x / 90) * std::sin(kPi * y / 75));
  const double share = fit_one(odd).sky.inlier_share;
  EXPECT_LT(share, 0.95);
  EXPECT_GT(share, 0.6);
}

TEST(FitSky, AnUnknownSunLeavesGradation) {
  Square square;
  square.wall = 0.05f;
  SkyFitOptions options;
  options.residual_order = 2;
  const SkyFit fit = fit_one(panorama_of(overcast_sky(), square), options);
  EXPECT_EQ(fit.sky.model, SkyModel::kGradation);
  EXPECT_TRUE(warns(fit, "--residual has no effect where the model is gradation"));
  EXPECT_EQ(fit.sky.fallback, "sun not known");
  EXPECT_EQ(fit.sky.channels[0].shape.c, 0);
  EXPECT_LT(dome_difference(fit.sky, overcast_sky()), 0.03);
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

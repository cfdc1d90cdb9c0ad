#include "roxel/synth/atmosphere.h"

#include <gtest/gtest.h>

#include <cmath>

namespace roxel {
namespace {

using Eigen::Vector3d;

Vector3d toward(double azimuth_deg, double elevation_deg) {
  const double a = azimuth_deg * M_PI / 180, e = elevation_deg * M_PI / 180;
  return {std::cos(e) * std::sin(a), std::cos(e) * std::cos(a), std::sin(e)};
}

// Straight up the layers' depths add: air 8 km, ozone a triangle of 15 km, haze as given.
TEST(Atmosphere, LightFromTheZenithFollowsBeersLaw) {
  for (const double haze : {0.0, 0.3}) {
    const Vector3d depth = 8 * Vector3d(5.802e-3, 13.558e-3, 33.1e-3) +
                           15 * Vector3d(0.650e-3, 1.881e-3, 0.085e-3) + Vector3d::Constant(haze);
    const Vector3d expected = (-depth).array().exp();
    EXPECT_LT((Atmosphere(haze).transmittance(1) - expected).norm(), 2e-3) << haze;
  }
}

TEST(Atmosphere, TheSunReddensAsItSinks) {
  const Atmosphere air(0.1);
  double ratio = 0;
  for (const double elevation : {60.0, 30.0, 10.0, 3.0}) {
    const Vector3d light = air.transmittance(std::sin(elevation * M_PI / 180));
    EXPECT_GT(light.x() / light.z(), ratio);
    ratio = light.x() / light.z();
  }
  EXPECT_GT(ratio, 5);
  EXPECT_EQ(air.transmittance(-0.2), Vector3d::Zero());
}

TEST(Atmosphere, TheSkyIsBlueWhiterAtTheHorizonAndBrightAboutTheSun) {
  const Atmosphere air(0.1);
  const Vector3d to_sun = toward(180, 40);
  const Vector3d zenith = air.radiance(toward(0, 90), to_sun), horizon = air.radiance(toward(0, 3), to_sun);
  EXPECT_GT(zenith.z() / zenith.x(), 2.5);
  EXPECT_LT(horizon.z() / horizon.x(), 0.7 * zenith.z() / zenith.x());
  EXPECT_GT(horizon.mean(), zenith.mean());
  EXPECT_GT(air.radiance(toward(180, 43), to_sun).mean(), 5 * air.radiance(toward(0, 43), to_sun).mean());
}

TEST(Atmosphere, ClearSkyLightIsATenthToAThirdOfTheSuns) {
  const Vector3d to_sun = toward(180, 50);
  const Atmosphere air(0.1);
  double sky = 0;
  constexpr int kRows = 16, kTurns = 32;
  for (int i = 0; i < kRows; ++i)
    for (int k = 0; k < kTurns; ++k) {
      const double elevation = std::asin(std::sqrt((i + 0.5) / kRows)) * 180 / M_PI;
      sky += air.radiance(toward(360.0 * k / kTurns, elevation), to_sun).mean() * M_PI / (kRows * kTurns);
    }
  const double sun = air.transmittance(to_sun.z()).mean() * to_sun.z();
  EXPECT_GT(sky / sun, 0.08);
  EXPECT_LT(sky / sun, 0.35);
}

TEST(Atmosphere, MoreHazeMeansMoreLightFromTheSkyAndLessFromTheSun) {
  const Atmosphere clear(0.03), murky(0.4);
  const Vector3d to_sun = toward(180, 40), up = toward(90, 60);
  EXPECT_GT(murky.radiance(up, to_sun).mean(), 1.5 * clear.radiance(up, to_sun).mean());
  EXPECT_LT(murky.transmittance(0.5).mean(), 0.7 * clear.transmittance(0.5).mean());
}

TEST(Atmosphere, IsFiniteAndPositiveEverywhere) {
  const Atmosphere air(0.2);
  for (double sun = 0; sun <= 90; sun += 15)
    for (double elevation = 0; elevation <= 90; elevation += 5)
      for (double azimuth = 0; azimuth < 360; azimuth += 45) {
        const Vector3d light = air.radiance(toward(azimuth, elevation), toward(0, sun));
        ASSERT_TRUE(light.allFinite() && (light.array() >= 0).all())
            << sun << " " << elevation << " " << azimuth;
      }
}

}  // namespace
}  // namespace roxel

#include "roxel/sky/sun_position.h"

#include <gtest/gtest.h>

#include <atomic>

#include <cmath>

#include <ctime>
#include "roxel/base/parallel.h"

namespace roxel {
namespace {

double utc(int year, int month, int day, int hour, int minute, int second) {
  std::tm time{};
  time.tm_year = year - 1900, time.tm_mon = month - 1, time.tm_mday = day;
  time.tm_hour = hour, time.tm_min = minute, time.tm_sec = second;
  return static_cast<double>(timegm(&time));
}

/// Printed positions are right to a few seconds of arc; ours leaves the sun's parallax out (0.0024 degrees).
constexpr double kTolerance = 0.01;

TEST(SunPosition, IsThatOfThePrintedExampleOfTheSolarPositionAlgorithm) {
  // [Reda04] appendix A.5: 17 October 2003, 12:30:30 at UTC - 7 h; elevation before refraction.
  const SunPosition sun = sun_position(utc(2003, 10, 17, 19, 30, 30), 39.742476, -105.1786);
  EXPECT_NEAR(sun.azimuth_deg, 194.34024, kTolerance);
  EXPECT_NEAR(sun.elevation_deg, 39.872046, kTolerance);
}

TEST(SunPosition, FromThePoleIsTheDeclination) {
  // [Meeus98] example 25.b: 13 October 1992, 0 h: declination -7 deg 47' 01.74".
  EXPECT_NEAR(sun_position(utc(1992, 10, 13, 0, 0, 0), 90, 0).elevation_deg, -7.78382, kTolerance);
  // Solstice and equinox of 2020 (USNO: 20 June 21:44, 20 March 03:50 UTC).
  EXPECT_NEAR(sun_position(utc(2020, 6, 20, 21, 44, 0), 90, 0).elevation_deg, 23.4366, kTolerance);
  EXPECT_NEAR(sun_position(utc(2020, 3, 20, 3, 50, 0), 90, 0).elevation_deg, 0, kTolerance);
}

TEST(SunPosition, GoesFromEastToWestOverTheSouthInTheNorthAndOverTheNorthInTheSouth) {
  EXPECT_NEAR(sun_position(utc(2020, 3, 20, 6, 7, 0), 0, 0).azimuth_deg, 90, 0.5);
  EXPECT_NEAR(sun_position(utc(2020, 3, 20, 18, 7, 0), 0, 0).azimuth_deg, 270, 0.5);
  EXPECT_NEAR(sun_position(utc(2020, 3, 20, 12, 7, 0), 50, 0).azimuth_deg, 180, 1);
  const double south = sun_position(utc(2020, 3, 20, 12, 7, 0), -50, 0).azimuth_deg;
  EXPECT_LT(std::min(south, 360 - south), 1);
}

TEST(SunPosition, ComesEarlierInTheEast) {
  const double noon = utc(2020, 3, 20, 12, 0, 0);
  const SunPosition here = sun_position(noon, 40, 0), east = sun_position(noon - 3600, 40, 15);
  EXPECT_NEAR(here.azimuth_deg, east.azimuth_deg, 0.05);
  EXPECT_NEAR(here.elevation_deg, east.elevation_deg, 0.05);
}

// Also not on what other threads ask meanwhile: skies of several nodes are fitted side by side.
TEST(SunPosition, DependsOnNothingThatWasAskedBefore) {
  constexpr double kTime = 1.06e9;
  sun_position(kTime + 3e7, 40, 10);
  const SunPosition alone = sun_position(kTime, 48, 2);
  for (const double before : {60.0, 3600.0, 7200.0, -7200.0, 86400.0}) {
    sun_position(kTime + 3e7, 40, 10);
    sun_position(kTime + before, 40, 10);
    const SunPosition after = sun_position(kTime, 48, 2);
    EXPECT_EQ(after.azimuth_deg, alone.azimuth_deg) << before;
    EXPECT_EQ(after.elevation_deg, alone.elevation_deg) << before;
  }
  std::atomic<int> others{0};
  parallel_for(4000, 4, [&](std::int64_t i, int) {
    const SunPosition now = sun_position(kTime + 1000 * (i % 2), 48, 2);
    others += i % 2 == 0 && now.azimuth_deg != alone.azimuth_deg;
  });
  EXPECT_EQ(others, 0);
}

TEST(SunDirection, IsEastNorthUp) {
  EXPECT_LT((sun_direction({90, 0}) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((sun_direction({0, 0}) - Eigen::Vector3d(0, 1, 0)).norm(), 1e-12);
  EXPECT_LT((sun_direction({0, 90}) - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12);
  EXPECT_NEAR(sun_direction({225, 30}).x(), -std::sqrt(0.5) * std::cos(M_PI / 6), 1e-12);
}

}  // namespace
}  // namespace roxel

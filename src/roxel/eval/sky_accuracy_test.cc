#include "roxel/eval/sky_accuracy.h"

#include <gtest/gtest.h>

#include "roxel/sky/sky_fixture.h"

namespace roxel {
namespace {

TEST(DomeError, IsTheMeanRelativeErrorAboveTheHorizon) {
  const Image truth = sky_map(clear_sky(), Disc::kWithout, 64, 32);
  Image ours = truth;
  for (float& value : ours.data()) value *= 1.1f;
  EXPECT_NEAR(dome_error(ours, truth), 0.1, 1e-6);
  EXPECT_EQ(dome_error(truth, truth), 0);
  for (int y = 16; y < 32; ++y) ours.pixel(3, y)[0] = 99;  // below the horizon
  EXPECT_NEAR(dome_error(ours, truth), 0.1, 1e-6);
}

TEST(DomeError, CountsByAreaNotByPixel) {
  const Image truth(64, 32, 3, 1);
  Image high = truth, low = truth;
  for (int x = 0; x < 64; ++x) high.pixel(x, 0)[1] = 2, low.pixel(x, 15)[1] = 2;
  const double top = 1 - std::cos(180.0 / 32 * kDegree), bottom = std::sin(180.0 / 32 * kDegree);
  EXPECT_NEAR(dome_error(high, truth), top / 3, 1e-6);
  EXPECT_NEAR(dome_error(low, truth), bottom / 3, 1e-6);
}

TEST(OracleDomeError, IsNextToNothingWhereTheTruthIsTheModel) {
  const NodeSky sky = clear_sky();
  const Image truth = sky_map(sky, Disc::kWithout, 128, 64);
  EXPECT_LT(oracle_dome_error(truth, sky.sun, PerezFreedom::kFull), 0.01);
}

TEST(MaskAgreement, IsIntersectionOverUnion) {
  Mask sky(4, 1, 0), surface(4, 1, 255);
  sky.at(0, 0) = 255, sky.at(1, 0) = 130;
  surface.at(1, 0) = 0, surface.at(2, 0) = 100;
  MaskAgreement agreement;
  agreement.add(sky, surface);
  EXPECT_EQ(agreement.both, 1);
  EXPECT_EQ(agreement.either, 3);
  EXPECT_NEAR(agreement.iou(), 1.0 / 3, 1e-12);
  EXPECT_EQ(MaskAgreement{}.iou(), 1);
}

TEST(AngleBetween, IsInDegrees) {
  EXPECT_NEAR(angle_between_deg({1, 0, 0}, {0, 2, 0}), 90, 1e-9);
  EXPECT_NEAR(angle_between_deg({1, 0, 0}, {1, 1, 0}), 45, 1e-9);
}

}  // namespace
}  // namespace roxel

#include "roxel/eval/reliability.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

namespace roxel {
namespace {

TEST(Reliability, ByHand) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> opacity{0.01f, 0.02f, 0.97f, 1.0f, 0.98f, 0.5f, nan};
  const std::vector<float> truth{0, 3, 2, 2, 0, nan, 1};
  const Reliability curve = reliability(opacity, truth);
  EXPECT_EQ(curve.total(), 5);
  EXPECT_EQ(curve.pixels[0], 2);
  EXPECT_DOUBLE_EQ(curve.surface_share(0), 0.5);
  EXPECT_NEAR(curve.mean_opacity(0), 0.015, 1e-7);
  EXPECT_EQ(curve.pixels[19], 3);
  EXPECT_DOUBLE_EQ(curve.surface_share(19), 2 / 3.0);
  EXPECT_EQ(curve.surface_share(10), 0);
  EXPECT_NEAR(curve.expected_calibration_error(), (std::abs(0.03 - 1) + std::abs(2.95 - 2)) / 5, 1e-6);
}

TEST(Reliability, HonestOpacitiesLieOnTheDiagonal) {
  std::mt19937 rng(2);
  std::uniform_real_distribution<double> uniform(0, 1);
  Reliability honest, bold;
  for (int i = 0; i < 200000; ++i) {
    const double p = uniform(rng);
    honest.add(p, uniform(rng) < p);
    bold.add(p, uniform(rng) < p * p);
  }
  for (int bin = 0; bin < Reliability::kBins; ++bin)  // standard error at most 0.005
    EXPECT_NEAR(honest.surface_share(bin), honest.mean_opacity(bin), 0.025);
  EXPECT_LT(honest.expected_calibration_error(), 0.008);
  EXPECT_NEAR(bold.expected_calibration_error(), 1 / 2.0 - 1 / 3.0, 0.01);
}

TEST(Reliability, ViewsAddUpAndSizesMustAgree) {
  Reliability a = reliability(std::vector<float>{0.3f}, std::vector<float>{1});
  a.add(reliability(std::vector<float>{0.32f}, std::vector<float>{0}));
  EXPECT_EQ(a.pixels[6], 2);
  EXPECT_DOUBLE_EQ(a.surface_share(6), 0.5);
  EXPECT_EQ(Reliability{}.expected_calibration_error(), 0);
  EXPECT_THROW(reliability(std::vector<float>(2), std::vector<float>(3)), std::logic_error);
}

}  // namespace
}  // namespace roxel

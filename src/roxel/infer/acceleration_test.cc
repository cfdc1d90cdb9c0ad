#include "roxel/infer/acceleration.h"

#include <gtest/gtest.h>

#include <cmath>

namespace roxel {
namespace {

/// An EM that goes the share 1 - rate of the way to its fixed point, in log tau.
struct Creeping {
  double rate;
  double goal;
  double operator()(double tau) const { return goal * std::pow(tau / goal, rate); }
};

double distance(double tau, double goal) { return std::abs(std::log(tau / goal)); }

TEST(Acceleration, OfLimitOneChangesNothing) {
  Acceleration none(1, 1);
  double tau = 0.3;
  for (int pass = 0; pass < 5; ++pass) {
    const double em = Creeping{0.8, 1.0}(tau);
    EXPECT_EQ(none(0, tau, em, 0.01), em);
    tau = em;
  }
}

TEST(Acceleration, TheFirstStepIsTwiceItsLength) {
  Acceleration acceleration(2, 8);
  EXPECT_NEAR(acceleration(0, 1.0, 1.1, 1e-6), 1.1 * 1.1, 1e-6);
  EXPECT_NEAR(acceleration(1, 1.0, 1 / 1.1, 1e-6), 1 / (1.1 * 1.1), 1e-6);
}

TEST(Acceleration, FindsTheFixedPointOfASteadyCreepAtOnce) {
  const Creeping em{0.9, 1.0};
  Acceleration acceleration(1, 20);
  double tau = 0.4, plain = 0.4;
  for (int pass = 0; pass < 2; ++pass) {
    tau = acceleration(0, tau, em(tau), 1e-6);
    plain = em(plain);
  }
  EXPECT_LT(distance(tau, 1), 1e-4);
  EXPECT_GT(distance(plain, 1), 0.7);
}

TEST(Acceleration, StepsAreNoLongerThanTheLimit) {
  const Creeping em{0.99, 1.0};  // wants 100 times its step
  Acceleration acceleration(1, 8);
  double tau = 0.8;
  tau = acceleration(0, tau, em(tau), 1e-6);
  const double step = std::log(em(tau) / tau);
  EXPECT_NEAR(std::log(acceleration(0, tau, em(tau), 1e-6) / tau), 8 * step, 1e-6);
}

TEST(Acceleration, StaysWhereEmStays) {
  Acceleration acceleration(1, 8);
  double tau = 0.7;
  for (int pass = 0; pass < 4; ++pass) tau = acceleration(0, tau, tau, 0.1);
  EXPECT_EQ(tau, 0.7);
}

TEST(Acceleration, AStepBackIsPlain) {
  Acceleration acceleration(1, 8);
  EXPECT_GT(acceleration(0, 1.0, 1.5, 1e-6), 2.2);
  EXPECT_NEAR(acceleration(0, 2.25, 2.0, 1e-6), 2.0, 1e-6);
}

TEST(Acceleration, ThePriorsShareBoundsIt) {
  Acceleration acceleration(2, 8);
  EXPECT_NEAR(acceleration(0, 1.0, 1.5, 1.0), 1.5, 1e-6);                            // all prior: plain EM
  EXPECT_NEAR(std::log(acceleration(1, 1.0, 1.5, 0.8)), 1.5 * std::log(1.5), 1e-6);  // 1 + 2 (1/0.8 - 1)
}

TEST(Acceleration, OfFallingOpacitiesAlone) {
  Acceleration falling(2, 8, Accelerate::kFalling);
  EXPECT_NEAR(falling(0, 1.0, 1.1, 1e-6), 1.1, 1e-6);
  EXPECT_NEAR(falling(1, 1.0, 1 / 1.1, 1e-6), 1 / (1.1 * 1.1), 1e-6);
}

TEST(Acceleration, VoxelsOfNothingAreLeftToEm) {
  Acceleration acceleration(1, 8);
  EXPECT_EQ(acceleration(0, 0.0, 0.5, 0.1), 0.5);
  EXPECT_EQ(acceleration(0, 0.5, 0.0, 0.1), 0.0);
}

TEST(Acceleration, OneStepGoesNoFartherThanTenTimesUnlessEmDoes) {
  Acceleration acceleration(2, 8);
  EXPECT_NEAR(acceleration(0, 1e-3, 5e-3, 1e-6), 1e-2, 1e-4);
  EXPECT_NEAR(acceleration(1, 1e-3, 5.0, 1e-6), 5.0, 1e-6);
}

}  // namespace
}  // namespace roxel

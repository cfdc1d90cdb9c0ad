#include "roxel/sky/perez.h"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "roxel/sky/sky_fixture.h"

namespace roxel {
namespace {

void expect_shape(const PerezShape& s, double a, double b, double c, double d, double e) {
  constexpr double kRounding = 2e-5;
  EXPECT_NEAR(s.a, a, kRounding);
  EXPECT_NEAR(s.b, b, kRounding);
  EXPECT_NEAR(s.c, c, kRounding);
  EXPECT_NEAR(s.d, d, kRounding);
  EXPECT_NEAR(s.e, e, kRounding);
  EXPECT_EQ(s.h, 1);
}

TEST(PublishedPerez, IsTheTableOfCoefficientsAtSamplePoints) {
  // By hand from [Perez93] table 1: x1 + x2 Z + brightness (x3 + x4 Z).
  expect_shape(published_perez(7, 0.5, 0.1), -0.975, -0.189265, 21.96977, -5.66253, 1.39252);
  expect_shape(published_perez(4, 1.0, 0.3), -1.0091, -0.80861, 11.93198, -3.1139, 0.0213);
  expect_shape(published_perez(2, 0.0, 0.2), -0.92096, -0.6218, 17.1819, -4.21542, 0.06838);
}

TEST(PublishedPerez, HasFormulasOfItsOwnForOvercastSkies) {
  expect_shape(published_perez(0, 0.5, 0.2), 1.02624, -0.5243, 0.739333, -0.519082, -0.04168);
}

TEST(PublishedPerez, RefusesBinsThatDoNotExist) {
  EXPECT_THROW(published_perez(8, 0, 0.1), std::logic_error);
  EXPECT_THROW(published_perez(-1, 0, 0.1), std::logic_error);
}

TEST(PerezRelative, IsItsFormula) {
  const double p[6] = {-0.9, -0.3, 7, -2, 0.4, 1.3};
  const double by_hand = (1 - 0.9 * std::exp(-0.3 / 0.6)) *
                         (1 + 7 * std::exp(-2 * std::pow(0.8, 1.3)) + 0.4 * std::cos(0.8) * std::cos(0.8));
  EXPECT_NEAR(perez_relative(p, 0.6, 0.8), by_hand, 1e-12);
}

TEST(PerezRelative, StaysFiniteAtTheHorizonAndInTheSun) {
  const double p[6] = {4, -0.7, 10, -3, 0.45, 0.5};
  EXPECT_NEAR(perez_relative(p, 0.0, 1.0), perez_relative(p, kLowestSine, 1.0), 1e-12);
  EXPECT_NEAR(perez_relative(p, 1.0, 0.0), (1 + 4 * std::exp(-0.7)) * (1 + 10 + 0.45), 1e-12);
}

TEST(PerezRelative, DerivativesAreThoseOfCentralDifferences) {
  using Jet = ceres::Jet<double, 6>;
  const double shapes[3][6] = {
      {-0.9, -0.3, 7, -2, 0.4, 1.3}, {4, -0.7, 0.1, -1, 0.05, 1}, {-1.1, -0.6, 14, -5, 1, 0.7}};
  for (const auto& shape : shapes)
    for (const double cos_theta : {0.05, 0.4, 0.95})
      for (const double phi : {0.1, 1.2, 2.8}) {
        Jet jets[6];
        for (int i = 0; i < 6; ++i) jets[i] = Jet(shape[i], i);
        const Jet value = perez_relative(jets, cos_theta, phi);
        for (int i = 0; i < 6; ++i) {
          double low[6], high[6];
          std::copy_n(shape, 6, low), std::copy_n(shape, 6, high);
          const double step = 1e-6;
          low[i] -= step, high[i] += step;
          const double difference =
              (perez_relative(high, cos_theta, phi) - perez_relative(low, cos_theta, phi)) / (2 * step);
          EXPECT_NEAR(value.v[i], difference, 1e-7 * (1 + std::abs(difference))) << "parameter " << i;
        }
      }
}

}  // namespace
}  // namespace roxel

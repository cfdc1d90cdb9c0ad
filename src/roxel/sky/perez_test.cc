#include "roxel/sky/perez.h"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "roxel/sky/sky_fixture.h"

namespace roxel {
namespace {

void expect_shape(const PerezShape& s, double a, double b, double c, double d, double e) {
  constexpr double kRounding = 6e-6;
  EXPECT_NEAR(s.a, a, kRounding);
  EXPECT_NEAR(s.b, b, kRounding);
  EXPECT_NEAR(s.c, c, kRounding);
  EXPECT_NEAR(s.d, d, kRounding);
  EXPECT_NEAR(s.e, e, kRounding);
  EXPECT_EQ(s.h, 1);
}

struct TablePoint {
  int bin;
  double zenith, brightness;
  std::array<double, 5> abcde;
};

TEST(PublishedPerez, IsTheTableOfCoefficientsInAllEightBins) {
  // From [Perez93] table 1, eq. (6) to (8), worked out apart: x1 + x2 Z + brightness (x3 + x4 Z), and the
  // formulas of their own that c and d have in the first bin. Two points a bin change all four coefficients.
  const TablePoint points[] = {
      {0, 0.3, 0.4, {0.99523, -0.27223, 2.46542, -1.19555, -0.11124}},
      {0, 1.2, 0.15, {0.74444, -0.59734, 0.57423, -0.46749, -0.02081}},
      {1, 0.3, 0.4, {-0.75569, -1.64964, 9.59243, -2.43175, 0.14354}},
      {1, 1.2, 0.15, {-1.73899, -0.58347, 8.13273, -2.43726, 0.23306}},
      {2, 0.3, 0.4, {-0.81550, -1.43497, 9.89880, -3.28875, 0.13353}},
      {2, 1.2, 0.15, {-1.26471, -0.40245, 9.64134, -3.05708, 0.13891}},
      {3, 0.3, 0.4, {-0.76950, -1.42009, 9.19827, -3.02770, 0.32803}},
      {3, 1.2, 0.15, {-1.25885, -0.40171, 11.41546, -3.30681, 0.05132}},
      {4, 0.3, 0.4, {-1.42798, -1.74292, 11.80398, -2.93628, -0.01559}},
      {4, 1.2, 0.15, {-0.98442, -0.16749, 13.34755, -3.40377, 0.06199}},
      {5, 0.3, 0.4, {-0.55397, -1.00734, 11.74942, -3.67392, 0.11583}},
      {5, 1.2, 0.15, {-1.05191, -0.32186, 13.08747, -3.40797, 0.37278}},
      {6, 0.3, 0.4, {-0.85410, -0.15722, 17.76839, -3.80687, 0.12835}},
      {6, 1.2, 0.15, {-0.99145, -0.25772, 12.84288, -3.86453, 0.48829}},
      {7, 0.3, 0.4, {-0.82785, 0.02122, 14.91158, -1.69489, 2.11741}},
      {7, 1.2, 0.15, {-0.88680, -0.06912, 16.71278, -4.63049, 1.10879}},
  };
  for (const TablePoint& p : points) {
    SCOPED_TRACE(p.bin);
    const auto& [a, b, c, d, e] = p.abcde;
    expect_shape(published_perez(p.bin, p.zenith, p.brightness), a, b, c, d, e);
  }
  const std::array<double, 8> lower_ends{1, 1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2};
  EXPECT_EQ(kClearness, lower_ends);
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

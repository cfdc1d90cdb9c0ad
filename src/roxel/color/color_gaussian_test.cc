#include "roxel/color/color_gaussian.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Dense>
#include <cmath>

namespace roxel {
namespace {

double draw(double low, double high) {
  return low + (high - low) * *rc::gen::inRange(0, 1 << 20) / (1 << 20);
}

/// A random colour whose covariance A A^T is positive semi-definite, of spread up to `spread`.
ColorGaussian draw_color(double range, double spread) {
  ColorGaussian color;
  Eigen::Matrix3d a;
  for (int i = 0; i < 3; ++i) color.mean[i] = float(draw(-range, range));
  for (int i = 0; i < 9; ++i) a(i / 3, i % 3) = draw(-spread, spread);
  const Eigen::Matrix3d cov = a * a.transpose();
  const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
  for (int i = 0; i < 6; ++i) color.cov[i] = float(cov(row[i], column[i]));
  return color;
}

WeightedColor draw_weighted() { return {draw_color(100, 10), float(draw(0, 4))}; }

bool close(const WeightedColor& a, const WeightedColor& b, float tolerance) {
  bool same = std::abs(a.weight - b.weight) <= 1e-5f * (1 + a.weight);
  for (int i = 0; i < 3; ++i) same &= std::abs(a.color.mean[i] - b.color.mean[i]) <= tolerance;
  for (int i = 0; i < 6; ++i) same &= std::abs(a.color.cov[i] - b.color.cov[i]) <= 100 * tolerance;
  return same;
}

Eigen::Matrix3d matrix(const float cov[6]) {
  Eigen::Matrix3d m;
  m << cov[0], cov[3], cov[4], cov[3], cov[1], cov[5], cov[4], cov[5], cov[2];
  return m;
}

/// The formula as printed, in doubles.
double plain_agreement(const ColorGaussian& a, const ColorGaussian& b, double noise) {
  const Eigen::Matrix3d sigma_min = noise * noise * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d sum = matrix(a.cov) + matrix(b.cov) + sigma_min;
  Eigen::Vector3d d;
  for (int i = 0; i < 3; ++i) d[i] = double(a.mean[i]) - b.mean[i];
  return std::sqrt(sigma_min.determinant() / sum.determinant()) * std::exp(-0.5 * d.dot(sum.inverse() * d));
}

TEST(ColorGaussian, MergeByHand) {
  const WeightedColor a{{{0, 10, 4}, {1, 2, 3, 0, 0, 0}}, 1};
  const WeightedColor b{{{4, 2, 4}, {5, 2, 1, 0, 0, 0.5f}}, 3};
  const WeightedColor c = merge(a, b);
  EXPECT_FLOAT_EQ(c.weight, 4);
  // Shares 1/4 and 3/4, difference (-4, 8, 0): between-scatter 3/16 (16, 64, 0, -32, 0, 0) = (3, 12, 0, -6,
  // 0, 0).
  const float mean[3] = {3, 4, 4}, cov[6] = {4 + 3, 2 + 12, 1.5f, -6, 0, 0.375f};
  for (int i = 0; i < 3; ++i) EXPECT_FLOAT_EQ(c.color.mean[i], mean[i]);
  for (int i = 0; i < 6; ++i) EXPECT_FLOAT_EQ(c.color.cov[i], cov[i]);
}

TEST(ColorGaussian, MergeOfPointsIsTheirPopulationCovariance) {
  const float points[4][3] = {{1, 2, 3}, {4, 0, 1}, {-2, 5, 5}, {3, 3, 3}};
  WeightedColor all;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) {
    WeightedColor one;
    one.weight = 1;
    for (int i = 0; i < 3; ++i) one.color.mean[i] = p[i];
    all = merge(all, one);
    mean += Eigen::Vector3d(p[0], p[1], p[2]) / 4;
  }
  Eigen::Matrix3d cov = Eigen::Matrix3d::Zero();
  for (const auto& p : points) {
    const Eigen::Vector3d d = Eigen::Vector3d(p[0], p[1], p[2]) - mean;
    cov += d * d.transpose() / 4;
  }
  EXPECT_LT((matrix(all.color.cov) - cov).norm(), 1e-5);
}

RC_GTEST_PROP(ColorGaussian, MergeIsCommutative, ()) {
  const WeightedColor a = draw_weighted(), b = draw_weighted();
  RC_ASSERT(close(merge(a, b), merge(b, a), 1e-4f));
}

RC_GTEST_PROP(ColorGaussian, MergeIsAssociative, ()) {
  const WeightedColor a = draw_weighted(), b = draw_weighted(), c = draw_weighted();
  RC_ASSERT(close(merge(merge(a, b), c), merge(a, merge(b, c)), 1e-3f));
}

RC_GTEST_PROP(ColorGaussian, WeightZeroIsTheIdentity, ()) {
  WeightedColor a = draw_weighted();
  a.weight += 0.1f;
  WeightedColor nothing{draw_color(100, 10), 0};
  RC_ASSERT(close(merge(a, nothing), a, 1e-5f));
  RC_ASSERT(merge(nothing, WeightedColor{}).weight == 0);
}

RC_GTEST_PROP(GaussianAgreement, IsTheFormula, ()) {
  const ColorGaussian a = draw_color(20, 10), b = draw_color(20, 10);
  const double noise = draw(1, 8);
  const double expected = plain_agreement(a, b, noise);
  const double found = GaussianAgreement(float(noise))(a, b);
  RC_ASSERT(std::abs(found - expected) <= 2e-3 * expected + 1e-12);
}

RC_GTEST_PROP(GaussianAgreement, IsSymmetricAndInTheUnitInterval, ()) {
  const ColorGaussian a = draw_color(20, 30), b = draw_color(20, 30);
  const GaussianAgreement agreement(4);
  RC_ASSERT(agreement(a, b) == agreement(b, a));
  RC_ASSERT(agreement(a, b) > 0);
  RC_ASSERT(agreement(a, b) <= 1);
}

RC_GTEST_PROP(GaussianAgreement, StaysInTheUnitIntervalForSpreadsOfHdrSamples, ()) {
  const double spread = *rc::gen::element(1e2, 1e3, 1e4);
  const ColorGaussian a = draw_color(4000, spread), b = draw_color(4000, spread);
  const float found = GaussianAgreement(4)(a, b);
  RC_ASSERT(found >= 0);
  RC_ASSERT(found <= 1);
}

TEST(GaussianAgreement, IsOneOnlyForEqualMeansWithoutSpread) {
  const GaussianAgreement agreement(4);
  const ColorGaussian grey{{50, 0, 0}, {}};
  EXPECT_FLOAT_EQ(agreement(grey, grey), 1);
  ColorGaussian moved = grey;
  moved.mean[1] = 0.1f;
  EXPECT_LT(agreement(grey, moved), 1);
  ColorGaussian wide = grey;
  wide.cov[2] = 0.1f;
  EXPECT_LT(agreement(grey, wide), 1);
}

TEST(GaussianAgreement, HasTheClosedFormOfOneDimension) {
  // Spread and difference along one axis only: sqrt(s^2 / (s^2 + v)) exp(-d^2 / (2 (s^2 + v))).
  const double noise = 3, variance = 7, d = 5;
  for (int axis = 0; axis < 3; ++axis) {
    ColorGaussian a, b;
    a.mean[axis] = float(d);
    a.cov[axis] = 2;
    b.cov[axis] = float(variance - 2);
    const double total = noise * noise + variance;
    EXPECT_NEAR(GaussianAgreement(float(noise))(a, b),
                std::sqrt(noise * noise / total) * std::exp(-d * d / (2 * total)), 1e-6);
  }
}

TEST(GaussianAgreement, ForgivesDifferencesAlongTheSpread) {
  // Perfectly correlated spread along (1, 1, 0): a shift along it agrees better than one across it.
  const ColorGaussian streak{{0, 0, 0}, {100, 100, 0, 100, 0, 0}};
  const ColorGaussian along{{7, 7, 0}, {}}, across{{7, -7, 0}, {}};
  const GaussianAgreement agreement(4);
  // S has eigenvalues 216, 16, 16; d^2 = 98.
  EXPECT_NEAR(agreement(streak, along), std::sqrt(16.0 / 216) * std::exp(-0.5 * 98 / 216), 1e-5);
  EXPECT_NEAR(agreement(streak, across), std::sqrt(16.0 / 216) * std::exp(-0.5 * 98 / 16), 1e-5);
}

TEST(ExponentialAgreement, ByHand) {
  const ColorGaussian a{{1, 2, 3}, {9, 9, 9, 0, 0, 0}}, b{{1, 4, 3}, {}};
  EXPECT_NEAR(ExponentialAgreement(2)(a, b), std::exp(-1.0), 1e-6);
  EXPECT_FLOAT_EQ(ExponentialAgreement(2)(a, a), 1);
}

TEST(LinearAgreement, FallsToZeroAtTheThreshold) {
  const ColorGaussian black, grey{{3, 4, 0}, {}};
  EXPECT_FLOAT_EQ(LinearAgreement(10)(black, grey), 0.5f);
  EXPECT_FLOAT_EQ(LinearAgreement(10, 0.49f)(black, grey), 0.5f);
  EXPECT_FLOAT_EQ(LinearAgreement(10, 0.51f)(black, grey), 0);
  EXPECT_FLOAT_EQ(LinearAgreement(4)(black, grey), 0);
  EXPECT_FLOAT_EQ(LinearAgreement(4)(grey, grey), 1);
}

}  // namespace
}  // namespace roxel

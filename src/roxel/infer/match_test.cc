#include "roxel/infer/match.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "roxel/color/color_gaussian.h"
#include "roxel/infer/gather.h"
#include "roxel/infer/pass_twin.h"

namespace roxel {
namespace {

constexpr double kUlp = 1.2e-7;

double relative(double got, double expected) { return std::abs(got - expected) / std::abs(expected); }

/// Every `x` of a dense sweep of [from, to), in equal steps of the exponent.
template <class Check>
void sweep(double from, double to, Check&& check) {
  for (double x = from; x < to; x *= 1.0003) check(static_cast<float>(x));
}

TEST(ExpNegative, RelativeErrorIsBelowItsPromise) {
  double worst = 0;
  sweep(1e-8, 86.9, [&](float x) {
    worst = std::max(worst,
                     relative(exp_negative(-x), static_cast<double>(std::exp(-static_cast<long double>(x)))));
  });
  EXPECT_LT(worst, 1e-5);  // the argument itself is rounded: 87 * 2^-24
  double worst_near = 0;
  sweep(1e-8, 8, [&](float x) {
    worst_near = std::max(
        worst_near, relative(exp_negative(-x), static_cast<double>(std::exp(-static_cast<long double>(x)))));
  });
  EXPECT_LT(worst_near, 1e-6);
}

TEST(ExpNegative, EndsAreExact) {
  EXPECT_EQ(exp_negative(0), 1);
  EXPECT_EQ(exp_negative(-0.0f), 1);
  for (const float x : {-88.0f, -1e4f, -1e30f, -std::numeric_limits<float>::infinity()}) {
    EXPECT_GE(exp_negative(x), 0);
    EXPECT_LT(exp_negative(x), 1e-37f);
  }
}

TEST(OneMinusExp, RelativeErrorIsBelowItsPromise) {
  double worst = 0;
  sweep(1e-30, 200, [&](float x) {
    worst = std::max(
        worst, relative(one_minus_exp(x), static_cast<double>(-std::expm1(-static_cast<long double>(x)))));
  });
  EXPECT_LT(worst, 1e-6);
  EXPECT_EQ(one_minus_exp(0), 0);
  EXPECT_LE(one_minus_exp(1e30f), 1);
}

TEST(OneMinusExp, IsMonotoneUpToRounding) {
  float last = 0;
  sweep(1e-6, 40, [&](float x) {
    const float a = one_minus_exp(x);
    ASSERT_GE(a, last * (1 - 4 * static_cast<float>(kUlp))) << x;
    ASSERT_LE(a, 1) << x;
    last = a;
  });
}

MatchBlock block_with(float tau, float length) {
  MatchBlock block{};
  block.tau[0] = tau;
  block.length[0] = length;
  for (int c = 0; c < 3; ++c) block.cov[c][0] = 1;
  block.evidence[0] = 1;
  return block;
}

/// Evaluates voxels whose covariances and differences of means the block has, against one sample.
void evaluate(const MatchModel& model, const SampleTerms& sample, int count, MatchBlock& block) {
  const MatchBlock before = block;
  SampleTerms spread = sample;
  std::fill(spread.mean, spread.mean + 3, 0.0f);
  bring_in_sample(spread, count, block);
  evaluate_match(model, count, block);
  std::copy(&before.cov[0][0], &before.cov[0][0] + 6 * MatchBlock::kSize, &block.cov[0][0]);
}

const SampleTerms kPlainSample{{0, 0, 0}, {16, 16, 16, 0, 0, 0}, 1};

/// Mean of t over [0, length] with density proportional to exp(-tau t), by Simpson's rule.
double integrated_mean_path(double tau, double length) {
  constexpr int kParts = 2000;
  double weight = 0, first = 0;
  for (int i = 0; i <= kParts; ++i) {
    const double t = length * i / kParts, simpson = i == 0 || i == kParts ? 1 : (i % 2 ? 4 : 2);
    weight += simpson * std::exp(-tau * t);
    first += simpson * t * std::exp(-tau * t);
  }
  return first / weight;
}

TEST(EvaluateMatch, MeanPathIsTheMeanOfWhereRaysEnd) {
  for (const double length : {0.05, 0.7, 1.0, 1.7})
    for (double tau = 1e-4; tau < 16; tau *= 1.15) {
      MatchBlock block = block_with(static_cast<float>(tau), static_cast<float>(length));
      evaluate({}, kPlainSample, 1, block);
      const double expected = integrated_mean_path(tau, length);
      // 1/x - (1-a)/a loses up to 1/x of a unit where it is not a series: x >= 0.5.
      EXPECT_NEAR(block.mean_path[0], expected, 3e-6 * length) << tau << " " << length;
    }
}

TEST(EvaluateMatch, MeanPathAtTheEnds) {
  MatchBlock block = block_with(0, 1.5f);
  evaluate({}, kPlainSample, 1, block);
  EXPECT_FLOAT_EQ(block.mean_path[0], 0.75f);
  EXPECT_EQ(block.opacity[0], 0);
  block = block_with(16, 1.7f);
  evaluate({}, kPlainSample, 1, block);
  EXPECT_NEAR(block.mean_path[0], 1 / 16.0, 1e-6);
  block = block_with(3, 0);  // a chord that only touches
  evaluate({}, kPlainSample, 1, block);
  EXPECT_EQ(block.opacity[0], 0);
  EXPECT_EQ(block.mean_path[0], 0);
}

struct RandomColors {
  std::mt19937 random;
  std::normal_distribution<double> normal{0, 1};

  ColorGaussian color(double range, double spread) {
    ColorGaussian out;
    Eigen::Matrix3d a;
    for (int i = 0; i < 9; ++i) a(i / 3, i % 3) = spread * normal(random);
    const Eigen::Matrix3d cov = a * a.transpose();
    for (int c = 0; c < 3; ++c) out.mean[c] = static_cast<float>(range * normal(random));
    const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    for (int c = 0; c < 6; ++c) out.cov[c] = static_cast<float>(cov(row[c], column[c]));
    return out;
  }
};

RegionStats as_sample(const ColorGaussian& color, float foreground) {
  RegionStats stats{};
  std::copy(color.mean, color.mean + 3, stats.mean);
  std::copy(color.cov, color.cov + 6, stats.cov);
  stats.valid = 1;
  stats.foreground = foreground;
  return stats;
}

/// A full block of random voxels against one random sample.
struct RandomBlock {
  std::vector<ColorGaussian> voxels;
  RegionStats sample;
  SampleTerms terms;
  MatchBlock block{};

  RandomBlock(const MatchModel& model, unsigned seed, double spread) {
    RandomColors colors{std::mt19937(seed), {}};
    std::uniform_real_distribution<float> unit(0, 1);
    sample = as_sample(colors.color(20, spread), unit(colors.random));
    terms = sample_terms(sample, model);
    for (int i = 0; i < MatchBlock::kSize; ++i) {
      voxels.push_back(colors.color(20, spread));
      for (int c = 0; c < 3; ++c) block.diff[c][i] = voxels[i].mean[c] - sample.mean[c];
      for (int c = 0; c < 6; ++c) block.cov[c][i] = voxels[i].cov[c];
      block.evidence[i] = unit(colors.random);
      block.tau[i] = 0.5f * unit(colors.random);
      block.length[i] = 1.7f * unit(colors.random);
    }
  }
};

/// p = foreground (w agreement + w_0 p_0) / (w + w_0) + outlier.
double expected_likelihood(const MatchModel& model, const RandomBlock& random, int i, double matched) {
  const double w = random.block.evidence[i], w_0 = model.evidence_half;
  return random.sample.foreground * (w * matched + w_0 * model.uninformative) / (w + w_0) + model.outlier;
}

TEST(EvaluateMatch, GaussianIsTheAgreementOfColorGaussians) {
  MatchModel model;
  std::fill_n(model.noise_variance, 3, 16.0f);
  const GaussianAgreement agreement_of(4);
  for (unsigned seed = 0; seed < 50; ++seed) {
    RandomBlock random(model, seed, 5);
    evaluate(model, random.terms, MatchBlock::kSize, random.block);
    ColorGaussian sample;
    std::copy(random.sample.mean, random.sample.mean + 3, sample.mean);
    std::copy(random.sample.cov, random.sample.cov + 6, sample.cov);
    for (int i = 0; i < MatchBlock::kSize; ++i) {
      const double expected = expected_likelihood(model, random, i, agreement_of(random.voxels[i], sample));
      EXPECT_NEAR(random.block.likelihood[i], expected, 2e-5 * expected);
    }
  }
}

TEST(EvaluateMatch, EveryAgreementIsItsFormulaInDoubles) {
  for (const Agreement kind : {Agreement::kGaussian, Agreement::kExponential, Agreement::kLinear}) {
    MatchModel model;
    model.agreement = kind;
    model.scale = kind == Agreement::kLinear ? 60 : 25;
    model.noise_variance[1] = 16;  // unlike the others
    for (unsigned seed = 0; seed < 30; ++seed) {
      RandomBlock random(model, seed, 3);
      evaluate(model, random.terms, MatchBlock::kSize, random.block);
      for (int i = 0; i < MatchBlock::kSize; ++i) {
        const Eigen::Vector3d d(random.block.diff[0][i], random.block.diff[1][i], random.block.diff[2][i]);
        const double matched =
            twin_agreement(model, d, twin_matrix(random.voxels[i].cov) + twin_matrix(random.sample.cov));
        const double expected = expected_likelihood(model, random, i, matched);
        // 1 - d / d_max is a difference of numbers near 1.
        EXPECT_NEAR(random.block.likelihood[i], expected, 2e-5 * expected + 2e-7) << static_cast<int>(kind);
      }
    }
  }
}

TEST(EvaluateMatch, OpacityIsThatOfTheChord) {
  const MatchModel model;
  RandomBlock random(model, 7, 3);
  evaluate(model, random.terms, MatchBlock::kSize, random.block);
  for (int i = 0; i < MatchBlock::kSize; ++i) {
    const double expected = -std::expm1(-static_cast<double>(random.block.tau[i]) * random.block.length[i]);
    EXPECT_NEAR(random.block.opacity[i], expected, 1e-6 * expected);
  }
}

TEST(EvaluateMatch, OnePairAtATimeIsTheBlock) {
  for (const Agreement kind : {Agreement::kGaussian, Agreement::kExponential, Agreement::kLinear}) {
    MatchModel model;
    model.agreement = kind;
    model.scale = 30;
    model.evidence_half = 0;
    model.outlier = 0;
    RandomBlock random(model, 8, 3);
    random.terms.foreground = 1;
    evaluate(model, random.terms, MatchBlock::kSize, random.block);
    for (int i = 0; i < MatchBlock::kSize; ++i) {
      float d[3], s[6];
      for (int c = 0; c < 3; ++c) d[c] = random.block.diff[c][i];
      for (int c = 0; c < 6; ++c) s[c] = random.block.cov[c][i] + random.terms.cov_plus_noise[c];
      EXPECT_NEAR(random.block.likelihood[i], agreement(model, d, s), 1e-5 * agreement(model, d, s) + 1e-12);
    }
  }
}

TEST(EvaluateMatch, WithoutEvidenceAVoxelIsUninformative) {
  MatchModel model;
  std::fill_n(model.noise_variance, 3, 16.0f);  // kPlainSample's
  model.uninformative = 0.003f;
  MatchBlock block = block_with(1, 1);
  block.evidence[0] = 0;
  evaluate(model, kPlainSample, 1, block);
  EXPECT_FLOAT_EQ(block.likelihood[0], 0.003f + 1e-7f);
  block.evidence[0] = model.evidence_half;  // half its own colour (agreement 1 without spread), half p_0
  for (int c = 0; c < 3; ++c) block.cov[c][0] = 0;
  evaluate(model, kPlainSample, 1, block);
  EXPECT_FLOAT_EQ(block.likelihood[0], 0.5f + 0.0015f + 1e-7f);
  model.evidence_half = 0;  // no prediction: no evidence, no agreement
  block.evidence[0] = 0;
  evaluate(model, kPlainSample, 1, block);
  EXPECT_FLOAT_EQ(block.likelihood[0], 1e-7f);
}

TEST(EvaluateMatch, ColoursFarApartNeverFallBelowTheOutlierFloor) {
  MatchModel model;
  model.evidence_half = 0;
  MatchBlock block = block_with(1, 1);
  block.diff[0][0] = 2000;
  evaluate(model, kPlainSample, 1, block);
  EXPECT_GE(block.likelihood[0], 1e-7f);
  EXPECT_LT(block.likelihood[0], 1.001e-7f);
}

// Spreads as large as clamped radiances allow (components below 1000), nearly singular: still a number in (0,
// 1].
TEST(EvaluateMatch, LargeThinSpreadsStayNumbers) {
  MatchModel model;
  model.evidence_half = 0;
  std::mt19937 seed_source(11);
  std::uniform_real_distribution<float> entry(-1000, 1000);
  for (int trial = 0; trial < 2000; ++trial) {
    MatchBlock block = block_with(1, 1);
    const float v[3] = {entry(seed_source), entry(seed_source), entry(seed_source)};
    const float cov[6] = {v[0] * v[0], v[1] * v[1], v[2] * v[2], v[0] * v[1], v[0] * v[2], v[1] * v[2]};
    for (int c = 0; c < 6; ++c) block.cov[c][0] = cov[c];
    for (int c = 0; c < 3; ++c) block.diff[c][0] = 0.01f * v[c];
    evaluate(model, kPlainSample, 1, block);
    ASSERT_TRUE(std::isfinite(block.likelihood[0])) << v[0] << " " << v[1] << " " << v[2];
    ASSERT_GT(block.likelihood[0], 0);
    ASSERT_LE(block.likelihood[0], 1.001f);
  }
}

RC_GTEST_PROP(Agreement, IsSymmetricAndAtMostOne, ()) {
  MatchModel model;
  RandomColors colors{std::mt19937(*rc::gen::arbitrary<unsigned>()), {}};
  const ColorGaussian a = colors.color(10, 4), b = colors.color(10, 4);
  float d[3], minus[3], s[6];
  for (int c = 0; c < 3; ++c) d[c] = a.mean[c] - b.mean[c], minus[c] = -d[c];
  for (int c = 0; c < 6; ++c) s[c] = a.cov[c] + b.cov[c] + (c < 3 ? model.noise_variance[c] : 0);
  const float there = agreement(model, d, s);
  RC_ASSERT(there == agreement(model, minus, s));
  RC_ASSERT(there >= 0 && there <= 1 + 1e-5f);
}

}  // namespace
}  // namespace roxel

#include "roxel/infer/match.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/kernel.h"

namespace roxel {

namespace {

/// 1/x - (1 - a)/a for a = 1 - exp(-x): from 1/2 at x = 0 down to 0.
inline __attribute__((always_inline)) float mean_path_core(float x, float a) {
  const float series = 0.5f - x * (1.0f / 12 - x * x * (1.0f / 720));
  // Kept away from 0, where the difference of the two large terms would lose its digits; the series serves
  // there.
  const float safe_x = x > 0.25f ? x : 0.25f;
  const float safe_a = a > 0.22119922f ? a : 0.22119922f;
  const float exact = (safe_a - safe_x * (1.0f - safe_a)) / (safe_x * safe_a);
  return x < 0.5f ? series : exact;
}

struct GaussianAgreement {
  float normaliser;  // sqrt |S_min|
  inline __attribute__((always_inline)) float operator()(float dx, float dy, float dz, float a, float b,
                                                         float c, float d, float e, float f) const {
    const float m00 = b * c - f * f, m01 = e * f - d * c, m02 = d * f - b * e;
    const float m11 = a * c - e * e, m12 = d * e - a * f, m22 = a * b - d * d;
    const float minors = a * m00 + d * m01 + e * m02;
    const float adjugate = m00 * dx * dx + m11 * dy * dy + m22 * dz * dz +
                           2.0f * (m01 * dx * dy + m02 * dx * dz + m12 * dy * dz);
    // S exceeds S_min, so its determinant does, too: hold on to that where rounding would not (wide thin
    // spreads).
    const float least = normaliser * normaliser;
    const float determinant = minors > least ? minors : least;
    const float quadratic = adjugate > 0.0f ? adjugate : 0.0f;
    const float inverse = 1.0f / determinant;
    return normaliser * std::sqrt(inverse) * exp_negative(-0.5f * quadratic * inverse);
  }
};

struct ExponentialAgreement {
  float inverse_squared_scale;
  inline __attribute__((always_inline)) float operator()(float dx, float dy, float dz, float, float, float,
                                                         float, float, float) const {
    return exp_negative(-(dx * dx + dy * dy + dz * dz) * inverse_squared_scale);
  }
};

struct LinearAgreement {
  float inverse_scale;
  inline __attribute__((always_inline)) float operator()(float dx, float dy, float dz, float, float, float,
                                                         float, float, float) const {
    const float d = std::sqrt(dx * dx + dy * dy + dz * dz) * inverse_scale;
    return d < 1.0f ? 1.0f - d : 0.0f;
  }
};

template <class Function>
inline __attribute__((always_inline)) void evaluate_with(const Function& agreement_of,
                                                         const MatchModel& model, int count,
                                                         MatchBlock& block) {
  const float outlier = model.outlier, half = model.evidence_half, uninformative = model.uninformative;
  // Whole rows of lanes: what lies behind the count is computed and left unread.
  const int padded = (count + kLanes - 1) / kLanes * kLanes;
  for (int i = 0; i < padded; ++i) {
    const float x = block.tau[i] * block.length[i];
    const float a = one_minus_exp(x);
    block.opacity[i] = a;
    block.mean_path[i] = block.length[i] * mean_path_core(x, a);
    const float matched =
        agreement_of(block.diff[0][i], block.diff[1][i], block.diff[2][i], block.cov[0][i], block.cov[1][i],
                     block.cov[2][i], block.cov[3][i], block.cov[4][i], block.cov[5][i]);
    const float w = block.evidence[i];
    const float mixed = (w * matched + half * uninformative) / (w + half + 1e-30f);
    block.likelihood[i] = block.foreground[i] * mixed + outlier;
  }
}

ROXEL_KERNEL void evaluate_gaussian(const GaussianAgreement& agreement_of, const MatchModel& model, int count,
                                    MatchBlock& block) {
  evaluate_with(agreement_of, model, count, block);
}
ROXEL_KERNEL void evaluate_exponential(const ExponentialAgreement& agreement_of, const MatchModel& model,
                                       int count, MatchBlock& block) {
  evaluate_with(agreement_of, model, count, block);
}
ROXEL_KERNEL void evaluate_linear(const LinearAgreement& agreement_of, const MatchModel& model, int count,
                                  MatchBlock& block) {
  evaluate_with(agreement_of, model, count, block);
}

GaussianAgreement gaussian_of(const MatchModel& model) {
  return {std::sqrt(model.noise_variance[0] * model.noise_variance[1] * model.noise_variance[2])};
}

}  // namespace

SampleTerms sample_terms(const RegionStats& sample, const MatchModel& model) {
  SampleTerms terms;
  for (int c = 0; c < 3; ++c) terms.mean[c] = sample.mean[c];
  for (int c = 0; c < 6; ++c)
    terms.cov_plus_noise[c] = sample.cov[c] + (c < 3 ? model.noise_variance[c] : 0.0f);
  terms.foreground = sample.foreground;
  return terms;
}

void evaluate_match(const MatchModel& model, int count, MatchBlock& block) {
  switch (model.agreement) {
    case Agreement::kGaussian:
      return evaluate_gaussian(gaussian_of(model), model, count, block);
    case Agreement::kExponential:
      return evaluate_exponential({1 / (model.scale * model.scale)}, model, count, block);
    case Agreement::kLinear:
      return evaluate_linear({1 / model.scale}, model, count, block);
  }
}

float agreement(const MatchModel& model, const float d[3], const float s[6]) {
  switch (model.agreement) {
    case Agreement::kGaussian:
      return gaussian_of(model)(d[0], d[1], d[2], s[0], s[1], s[2], s[3], s[4], s[5]);
    case Agreement::kExponential:
      return ExponentialAgreement{1 / (model.scale * model.scale)}(d[0], d[1], d[2], 0, 0, 0, 0, 0, 0);
    case Agreement::kLinear:
      return LinearAgreement{1 / model.scale}(d[0], d[1], d[2], 0, 0, 0, 0, 0, 0);
  }
  return 0;
}

}  // namespace roxel

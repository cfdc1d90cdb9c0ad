#pragma once
/// How well what a ray sees agrees with what voxels look like, for a block of voxels at once: the innermost
/// loop of every pass. Formulas: equations in docs/color.md and docs/passes.md; [Jethwa04] eq. (4.1), (4.2),
/// (4.5).

#include <bit>
#include <cstdint>

#include "roxel/image/sample_pyramid.h"

namespace roxel {

enum class Agreement {
  kGaussian,     ///< sqrt(|S_min| / |S_12|) exp(-d' S_12^-1 d / 2), S_12 = S_1 + S_2 + S_min
  kExponential,  ///< exp(-d^2 / scale^2)
  kLinear,       ///< max(0, 1 - d / scale)
};

/// Everything about colour matching that is the same for a whole pass.
struct MatchModel {
  Agreement agreement = Agreement::kGaussian;
  float noise_variance[3] = {16, 16, 16};  ///< diagonal of S_min, in the matching space
  float scale = 10;                        ///< of the exponential and linear baselines, matching-space units
  float evidence_half = 0.2f;              ///< w_0: evidence at which a voxel's own colour counts half
  float uninformative = 0.001f;            ///< p_0: likelihood where there is no evidence
  float outlier = 1e-7f;                   ///< floor of every likelihood
};

/// The parts of a sample that a block of voxels shares.
struct SampleTerms {
  float mean[3];
  float cov_plus_noise[6];  ///< xx, yy, zz, xy, xz, yz
  float foreground;         ///< share of the sample that is object, 0 to 1
};

SampleTerms sample_terms(const RegionStats& sample, const MatchModel& model);

/// Structure of arrays for up to kSize voxels along a ray: the inputs are gathered, the outputs computed.
struct alignas(64) MatchBlock {
  static constexpr int kSize = 64;
  float diff[3][kSize];     ///< in: voxel mean minus sample mean
  float cov[6][kSize];      ///< in: voxel covariance
  float evidence[kSize];    ///< in: weight w of the voxel's colour evidence
  float tau[kSize];         ///< in: optical depth of one voxel length
  float length[kSize];      ///< in: chord in voxel lengths
  float opacity[kSize];     ///< out: a = 1 - exp(-tau length)
  float mean_path[kSize];   ///< out: e = 1/tau - length (1 - a)/a, the mean distance of an ending inside
  float likelihood[kSize];  ///< out: p
};

/// Fills the outputs of the first `count` entries.
void evaluate_match(const MatchModel& model, const SampleTerms& sample, int count, MatchBlock& block);

/// Agreement of two Gaussians in (0, 1] (or the baseline's value), one pair at a time; the slow twin of the
/// block.
float agreement(const MatchModel& model, const float mean_difference[3], const float cov_sum_plus_noise[6]);

namespace internal {

/// 2^n and 2^f - 1 for y = n + f <= 0 with |f| <= 1/2, by the series of 2^f - 1 to degree 6.
struct PowerOfTwo {
  float whole;
  float fraction_less_one;
};
inline __attribute__((always_inline)) PowerOfTwo power_of_two(float y) {
  const int n = static_cast<int>(y - 0.5f);  // y <= 0: truncation rounds to the nearest
  const float f = y - static_cast<float>(n);
  float s = 1.540353039e-4f;
  s = s * f + 1.333355814e-3f;
  s = s * f + 9.618129107e-3f;
  s = s * f + 5.550410866e-2f;
  s = s * f + 2.402265070e-1f;
  s = s * f + 6.931471806e-1f;
  return {std::bit_cast<float>((n + 127) << 23), s * f};
}

}  // namespace internal

// Plain arithmetic without branches, so that the loops around these vectorise.

/// exp(x) for x <= 0, relative error below 1e-6; exp(-87), about 1.6e-38, below -87.
inline __attribute__((always_inline)) float exp_negative(float x) {
  const auto power = internal::power_of_two((x < -87.0f ? -87.0f : x) * 1.44269504088896341f);
  return power.whole * power.fraction_less_one + power.whole;
}

/// 1 - exp(-x) for x >= 0, relative error below 1e-6, small x too.
inline __attribute__((always_inline)) float one_minus_exp(float x) {
  const auto power = internal::power_of_two((x > 87.0f ? -87.0f : -x) * 1.44269504088896341f);
  return (1.0f - power.whole) - power.whole * power.fraction_less_one;
}

}  // namespace roxel

#pragma once
/// How well what a ray sees agrees with what voxels look like, for a block of voxels at once: the innermost
/// loop of every pass. Formulas: equations in docs/color.md and docs/passes.md; [Jethwa04] eq. (4.1), (4.2),
/// (4.5).

#include "roxel/base/fast_exp.h"
#include "roxel/base/lanes.h"
#include "roxel/image/sample_pyramid.h"
#include "roxel/march/packet_steps.h"

namespace roxel {

enum class Agreement {
  kGaussian,     ///< sqrt(|S_min| / |S_12|) exp(-d' S_12^-1 d / 2), S_12 = S_1 + S_2 + S_min
  kExponential,  ///< exp(-d^2 / scale^2)
  kLinear,       ///< max(0, 1 - d / scale)
};

/// Everything about colour matching that is the same for a whole pass. Defaults: Luv, with the noise of
/// default_noise().
struct MatchModel {
  Agreement agreement = Agreement::kGaussian;
  float noise_variance[3] = {9, 9, 9};  ///< diagonal of S_min, in the matching space
  float scale = 7.5f;                   ///< of the exponential and linear baselines, matching-space units
  float evidence_half = 0.02f;          ///< w_0: evidence at which a voxel's own colour counts half
  float uninformative =
      0.000320427527f;    ///< p_0: likelihood where there is no evidence (unknown_color_likelihood)
  float outlier = 1e-7f;  ///< floor of every likelihood
};

/// The parts of a sample that a block of voxels shares.
struct SampleTerms {
  float mean[3];
  float cov_plus_noise[6];  ///< xx, yy, zz, xy, xz, yz
  float foreground;         ///< share of the sample that is object, 0 to 1
};

SampleTerms sample_terms(const RegionStats& sample, const MatchModel& model);

/// Structure of arrays for up to kSize voxels, each with the sample that it is compared with: the inputs are
/// gathered, the outputs computed.
struct alignas(64) MatchBlock {
  static constexpr int kSize = PacketSteps::kPadded;
  float diff[3][kSize];     ///< in: voxel mean minus sample mean
  float cov[6][kSize];      ///< in: the voxel's covariance, the sample's and the noise's, summed
  float foreground[kSize];  ///< in: share of the sample that is object
  float evidence[kSize];    ///< in: weight w of the voxel's colour evidence
  float tau[kSize];         ///< in: optical depth of one voxel length
  float length[kSize];      ///< in: chord in voxel lengths
  float opacity[kSize];     ///< out: a = 1 - exp(-tau length)
  float mean_path[kSize];   ///< out: e = 1/tau - length (1 - a)/a, the mean distance of an ending inside
  float likelihood[kSize];  ///< out: p
};

/// Fills the outputs of the first `count` entries, at most kSize.
void evaluate_match(const MatchModel& model, int count, MatchBlock& block);

/// Agreement of two Gaussians in (0, 1] (or the baseline's value), one pair at a time; the slow twin of the
/// block.
float agreement(const MatchModel& model, const float mean_difference[3], const float cov_sum_plus_noise[6]);

}  // namespace roxel

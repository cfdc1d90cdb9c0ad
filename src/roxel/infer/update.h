#pragma once
/// From the evidence of all nodes to the volume: opacity under its prior, colour, confidence. docs/passes.md.

#include "roxel/infer/acceleration.h"
#include "roxel/infer/evidence.h"
#include "roxel/infer/passes.h"

namespace roxel {

/// Gamma prior on optical depth with its mode at a field that knows that surfaces are sheets.
struct PriorOptions {
  double opacity = 0.02;         ///< alpha_0, in (0, 1)
  double strength = 1;           ///< beta >= 0, in observations
  double spatial_lambda = 0.99;  ///< lambda in [0, 1]: weight of the neighbours' opacity in the prior's mode
  double sharpness = 1;          ///< g >= 1: power that the odds of the neighbours' opacity are raised to
};

/// Opacity that a sharpened prior parts empty from opaque at. Measured on a head: at 0.5 outlines wear off
/// (the error of renders over the object's pixels rises by a thirtieth), at 0.4 they swell (0.2 % more depths
/// are off by over four voxels).
inline constexpr float kSharpenedAround = 0.45f;

/// The prior's mode of every voxel, as opacity: (1 - lambda) alpha_0 + lambda * the largest mean opacity of
/// the voxel's neighbours in one of the 13 planes with a neighbour's direction as normal; absent neighbours
/// count 0. With a sharpness g > 1 that mean m becomes o^g / (1 + o^g) for o = m / (1 - m) over the odds of
/// kSharpenedAround.
std::vector<float> prior_opacity_field(const Volume& volume, const PriorOptions& prior, int threads);

struct UpdateReport {
  double mean_opacity_change = 0;  ///< over voxels that were looked at
  double mean_opacity = 0;         ///< over all voxels
};

/// Sets tau, confidence and support from the totals.
/// Posterior: tau <- (hits + beta tau_0) / (exposure + beta). Roxels: alpha <- exposure / hits, alpha_0
/// without hits. `acceleration`, unless null, lengthens posterior steps.
UpdateReport update_opacity(UpdateRule rule, const Totals& totals, const std::vector<float>& prior_opacity,
                            double prior_strength, int threads, Volume& volume,
                            Acceleration* acceleration = nullptr);

/// Sets the colour channels from the totals; voxels without evidence keep what they have.
void update_color(const std::vector<ColorTotals>& totals, int threads, Volume& volume);

}  // namespace roxel

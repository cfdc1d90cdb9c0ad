#pragma once
/// What a ray sees when it passes every voxel (docs/background.md).

#include "roxel/infer/match.h"
#include "roxel/infer/sample_view.h"

namespace roxel {

enum class BackgroundKind {
  kNone,     ///< every ray ends in the volume: likelihood 0
  kUnknown,  ///< any colour of the gamut alike: a constant likelihood
  kKnown,    ///< one colour with a spread (black, or a constant one): agreement as for voxels
  kMask,  ///< the share of the sample that the mask calls background; views without a mask: see smooth_share
};

struct Background {
  BackgroundKind kind = BackgroundKind::kUnknown;
  float mean[3] = {0, 0, 0};  ///< kKnown: matching space; kMask: what a smooth background looks like
  float cov[6] = {0, 0, 0, 0, 0, 0};
  /// kMask, of views without a mask: how likely their background is a smooth one, besides any colour.
  float smooth_share = 0;
  float unknown_likelihood = 0.000320427527f;  ///< of any colour: (2 pi)^{3/2} |S_min|^{1/2} / gamut volume
};

/// Likelihood p_bg of the view's sample if nothing in the volume stopped its ray.
float background_likelihood(const Background& background, const MatchModel& model, const SampleView& view,
                            const RegionStats& sample);

/// How surely the sample shows a *known* background, 0 to 1: such samples do not colour voxels.
float known_background_share(const Background& background, const MatchModel& model,
                             const RegionStats& sample);

}  // namespace roxel

#include "roxel/infer/background.h"

namespace roxel {

namespace {

float known_agreement(const Background& background, const MatchModel& model, const RegionStats& sample) {
  const SampleTerms terms = sample_terms(sample, model);
  float difference[3], cov[6];
  for (int c = 0; c < 3; ++c) difference[c] = background.mean[c] - sample.mean[c];
  for (int c = 0; c < 6; ++c) cov[c] = background.cov[c] + terms.cov_plus_noise[c];
  return agreement(model, difference, cov);
}

}  // namespace

float background_likelihood(const Background& background, const MatchModel& model, const SampleView& view,
                            const RegionStats& sample) {
  switch (background.kind) {
    case BackgroundKind::kNone:
      return 0;
    case BackgroundKind::kUnknown:
      return background.unknown_likelihood;
    case BackgroundKind::kKnown:
      return known_agreement(background, model, sample) + model.outlier;
    case BackgroundKind::kMask:
      if (view.pyramid->masked()) return (1 - sample.foreground) + model.outlier;
      if (background.smooth_share <= 0) return background.unknown_likelihood;
      return background.unknown_likelihood +
             background.smooth_share * known_agreement(background, model, sample);
  }
  return 0;
}

float known_background_share(const Background& background, const MatchModel& model,
                             const RegionStats& sample) {
  if (background.kind == BackgroundKind::kKnown) return known_agreement(background, model, sample);
  if (background.kind == BackgroundKind::kMask) return 1 - sample.foreground;
  return 0;
}

}  // namespace roxel

#include "roxel/infer/background.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace roxel {
namespace {

RegionStats sample_of(float l, float foreground) { return {{l, 0, 0}, {9, 9, 9, 0, 0, 0}, 1, foreground}; }

/// A view of one pixel, with a mask or without.
SampleView view_with(const Mask& foreground) {
  SampleView view;
  view.pyramid = std::make_shared<SamplePyramid>(Image(1, 1, 3), Mask(), foreground, 0, 0);
  return view;
}
const SampleView kMasked = view_with(Mask(1, 1)), kUnmasked = view_with(Mask());

Background background_of(BackgroundKind kind) {
  Background background;
  background.kind = kind;
  background.mean[0] = 20;
  background.cov[0] = 4;
  background.unknown_likelihood = 0.002f;
  return background;
}

MatchModel model_of_noise_4() {
  MatchModel model;
  std::fill_n(model.noise_variance, 3, 16.0f);
  return model;
}

/// sqrt(|S_min| / |S|) exp(-d^2 / (2 S)) along the first axis: noise 16, sample 9, background 4.
double known_agreement(double d) {
  return std::sqrt(16.0 * 16 * 16 / (29.0 * 25 * 25)) * std::exp(-0.5 * d * d / 29);
}

TEST(Background, NoneIsNeverSeen) {
  const Background none = background_of(BackgroundKind::kNone);
  EXPECT_EQ(background_likelihood(none, {}, kMasked, sample_of(20, 1)), 0);
  EXPECT_EQ(known_background_share(none, {}, sample_of(20, 1)), 0);
}

TEST(Background, UnknownIsAnyColourAlike) {
  const Background unknown = background_of(BackgroundKind::kUnknown);
  for (const float l : {0.0f, 20.0f, 90.0f})
    EXPECT_EQ(background_likelihood(unknown, {}, kMasked, sample_of(l, 1)), 0.002f);
  EXPECT_EQ(known_background_share(unknown, {}, sample_of(20, 1)), 0);
}

TEST(Background, KnownIsAgreementWithItsColour) {
  const Background known = background_of(BackgroundKind::kKnown);
  const MatchModel model = model_of_noise_4();
  for (const float l : {20.0f, 27.0f, 35.0f}) {
    EXPECT_NEAR(background_likelihood(known, model, kUnmasked, sample_of(l, 1)),
                known_agreement(l - 20) + 1e-7, 1e-6);
    EXPECT_NEAR(known_background_share(known, model, sample_of(l, 1)), known_agreement(l - 20), 1e-6);
  }
}

TEST(Background, MaskIsTheShareCalledBackground) {
  const Background mask = background_of(BackgroundKind::kMask);
  for (const float foreground : {0.0f, 0.3f, 1.0f}) {
    EXPECT_NEAR(background_likelihood(mask, {}, kMasked, sample_of(20, foreground)), 1 - foreground + 1e-7,
                1e-7);
    EXPECT_NEAR(known_background_share(mask, {}, sample_of(20, foreground)), 1 - foreground, 1e-7);
  }
}

TEST(Background, WithoutAMaskOfItsOwnAViewsBackgroundIsAnyColourAlike) {
  const Background mask = background_of(BackgroundKind::kMask);
  EXPECT_EQ(background_likelihood(mask, {}, kUnmasked, sample_of(20, 1)), 0.002f);
  EXPECT_EQ(known_background_share(mask, {}, sample_of(20, 1)), 0);
}

TEST(Background, WithoutAMaskItMayBeSmooth) {
  Background mask = background_of(BackgroundKind::kMask);
  mask.smooth_share = 0.25f;
  const MatchModel model = model_of_noise_4();
  for (const float l : {20.0f, 35.0f})
    EXPECT_NEAR(background_likelihood(mask, model, kUnmasked, sample_of(l, 1)),
                0.002 + 0.25 * known_agreement(l - 20), 1e-6);
  EXPECT_NEAR(background_likelihood(mask, model, kMasked, sample_of(20, 1)), 1e-7, 1e-9);
}

}  // namespace
}  // namespace roxel

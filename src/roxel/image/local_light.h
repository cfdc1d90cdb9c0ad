#pragma once
/// Photographs with the light of each neighbourhood divided out, for comparing surfaces under different
/// light. Homomorphic, in the spirit of the Retinex methods of [Jethwa04] section 4.1.4.

#include "roxel/image/image.h"

namespace roxel {

struct LocalLightOptions {
  double blur_px = 28;       ///< standard deviation of the neighbourhood, pixels, > 0
  double tint = 0.5;         ///< share of the neighbourhood's tint that goes as well, 0 to 1
  float darkest = 0.002f;    ///< added to every value before the logarithm: noise in the dark stays small
  float mean_level = 0.18f;  ///< what a pixel as bright as its neighbourhood becomes
};

/// exp(log I - [l + tint (B - l)]) times mean_level, where B is the blur of log I per channel over usable
/// pixels and l its mean over channels. `rgb` has 3 channels, linear, >= 0 (below counts as 0). A pixel
/// counts in the blur by its share in both masks (each empty = all 255, or of the image's size). Pixels far
/// from any that count are divided by the mean of all that do.
Image without_local_light(const Image& rgb, const Mask& valid, const Mask& foreground,
                          const LocalLightOptions& options);

}  // namespace roxel

#pragma once
/// Which background a data set has, from its masks and the pixels along the images' borders.

#include "roxel/solve/scene.h"

namespace roxel {

/// What one image tells: whether it has a mask, and the colours along its border.
struct BorderSample {
  bool has_mask = false;
  std::vector<std::array<float, 3>> colors;  ///< linear RGB as read, a few hundred
};

BorderSample sample_border(const Photograph& photo);

/// Chooses, or obeys options.background, under scene.exposure and scene.transform, and sets scene.masked;
/// appends to scene.notes why. `daylight` where it is known, else null: its masks count where there are some,
/// those of objects where there are all. Throws InvalidInput where masks are asked for and missing.
void choose_background(const std::vector<BorderSample>& borders, const ReconstructOptions& options,
                       const Daylight* daylight, Scene& scene);

}  // namespace roxel

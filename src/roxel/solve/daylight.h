#pragma once
/// The skies over a data set's photographs, as far as they are known before a reconstruction, and what their
/// light is worth ([Jethwa04] section 7.2.3; docs/light.md).

#include <array>
#include <string>
#include <vector>

#include "roxel/sky/node_sky.h"

namespace roxel {

/// What a dome's light is worth, in one number a channel.
enum class DomeLight {
  kHorizontal,  ///< what a white surface that looks up looks like: irradiance over pi
  kMean,        ///< plain mean of radiance [Jethwa04] §7.2.3
};

struct Daylight {
  std::vector<NodeSky> skies;
  std::vector<int> sky_of_views;  ///< one a view; -1 where none is known
  bool masks = false;             ///< photographs come with masks that call the sky background

  /// Of a view; null where no light is known.
  const NodeSky* of_view(int view_idx) const;
};

/// The geometric mean over the views of the luminance of their domes' light, the sun's disc included; 0 where
/// no view has one.
double mean_light(const Daylight& daylight, DomeLight worth = DomeLight::kHorizontal);

/// Each view's dome's light, the sun's disc included, over mean_light: canonical colours are as under white
/// light of mean strength. Views without a known light get 1. Empty where no view has one.
std::vector<std::array<float, 3>> light_of_views(const Daylight& daylight,
                                                 DomeLight worth = DomeLight::kHorizontal);

}  // namespace roxel

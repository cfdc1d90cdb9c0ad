#pragma once
/// The skies over a data set's photographs, as far as they are known before a reconstruction, and what their
/// light is worth ([Jethwa04] section 7.2.3; docs/light.md).

#include <array>
#include <cstdint>
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
  std::vector<int> sky_of_views;         ///< one a view; -1 where none is known
  std::vector<std::uint8_t> sky_masked;  ///< one a view, 1: it comes with a mask that calls the sky
                                         ///< background; empty: none does

  /// Of a view; null where its light is not known as a whole.
  const NodeSky* of_view(int view_idx) const;
  bool has_masks() const;
};

/// Why a node's light is not known as a whole; empty where it is. That takes a model, and the sun's place,
/// which most of the light comes from, unless the sky is evidently overcast: neutral, and brighter at the
/// zenith than above the horizon.
std::string why_no_light(const NodeSky& sky);

/// "3 night (n03, n04), 1 sun not known (n05)": why views have no light, by how many; of those that no sky is
/// of, too. Empty where all have.
std::string reasons_without_light(const Daylight& daylight);

/// The geometric mean over the views of the luminance of their domes' light, the sun's disc included; 0 where
/// no view has one.
double mean_light(const Daylight& daylight, DomeLight worth = DomeLight::kHorizontal);

/// Each view's dome's light, the sun's disc included, over mean_light: canonical colours are as under white
/// light of mean strength. Views without a known light get 1. Empty where no view has one.
std::vector<std::array<float, 3>> light_of_views(const Daylight& daylight,
                                                 DomeLight worth = DomeLight::kHorizontal);

}  // namespace roxel

#pragma once
/// The skies over a data set's photographs, as far as they are known before a reconstruction, and what their
/// light is worth ([Jethwa04] section 7.2.3; docs/light.md).

#include <array>
#include <string>
#include <vector>

#include "roxel/sky/node_sky.h"

namespace roxel {

struct Daylight {
  std::vector<NodeSky> skies;
  std::vector<int> sky_of_views;  ///< one a view; -1 where none is known
  bool masks = false;             ///< photographs come with masks that call the sky background

  /// Of a view; null where no light is known.
  const NodeSky* of_view(int view_idx) const;
};

/// What a white horizontal surface looks like under each view's whole dome, the sun's disc included, over the
/// geometric mean luminance of that of all views: canonical colours are as under white light of mean
/// strength. Views without a known light get 1. Empty where no view has one.
std::vector<std::array<float, 3>> light_of_views(const Daylight& daylight);

}  // namespace roxel

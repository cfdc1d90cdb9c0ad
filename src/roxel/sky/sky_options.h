#pragma once
/// The options of a sky fit as people set them (docs/options.md).

#include <array>
#include <optional>

#include "roxel/base/option_table.h"
#include "roxel/sky/sky_fit.h"

namespace roxel {

struct SkyOptions {
  SkyFitOptions fit;
  std::optional<std::array<double, 2>> sun;  ///< azimuth, elevation, degrees
  std::optional<std::array<double, 3>> up;   ///< world
  std::optional<std::string> sky_masks;      ///< folder of masks by hand

  /// `fit` with the sun by hand in it.
  SkyFitOptions fit_options() const;
};

const OptionTable<SkyOptions>& sky_option_table();

}  // namespace roxel

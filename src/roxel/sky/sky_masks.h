#pragma once
/// Which facets show sky, before anything has been fitted ([Jethwa04] §3.2): three masks, each by itself, and
/// which of them the pictures themselves bear out.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "roxel/sky/sphere_light.h"

namespace roxel {

struct SkyMaskOptions {
  double lowest_elevation_deg = 0;  ///< facets below it are left out
  double contrast_limit = 0.08;     ///< deviation of luminance over mean within a facet
  double red_blue_limit = 0.95;     ///< red over blue [Jethwa04] §3.3
  double least_coverage = 0.5;      ///< of a facet's area
  double step_limit = 0.12;         ///< of log luminance from facet to facet within one region
};

/// One entry a facet, 1 where the mask takes the facet out.
struct SkyMasks {
  std::vector<std::uint8_t> unusable;   ///< below the horizon, hardly seen, or clipped
  std::vector<std::uint8_t> variance;   ///< too much contrast within the facet
  std::vector<std::uint8_t> red_blue;   ///< not blue enough
  std::vector<std::uint8_t> luminance;  ///< darker than the mean of what is seen, sun left out
  std::vector<std::uint8_t>
      near_sun;                   ///< within 3 degrees of the sun: never in the fit, the masks do not count
  std::vector<std::uint8_t> sky;  ///< 1 = sky, as far as all of this says
  std::vector<std::vector<int>>
      apart;  ///< smooth regions that pass the masks in use, but are too small to be sure
  std::vector<std::vector<int>> unexplained;  ///< smooth regions where a volume knows of nothing
  /// Clipped facets that hang together, higher up than anything else: sky, brighter than the pictures can
  /// say.
  std::vector<int> white;
  double mean_luminance = 0;
  bool red_blue_used = false, luminance_used = false;
  double red_blue_share = 0;   ///< of the region that is surely sky: passes the red over blue mask
  double luminance_share = 0;  ///< of it: passes the luminance mask
  bool by_hand = false;        ///< masks by hand say what is sky
  std::string reason;          ///< why masks are used or not
};

/// Share of a facet's light that must be clipped for its mean to say little.
inline constexpr double kClippedShare = 0.1;

/// `sun` (sky frame) where it is known. Where masks by hand say what is sky, they alone decide.
SkyMasks sky_masks(const SphereLight& light, const std::optional<Eigen::Vector3d>& sun,
                   const SkyMaskOptions& options);

}  // namespace roxel

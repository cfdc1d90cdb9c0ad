#pragma once
/// The sun as pictures show it: where the brightest cluster of facets is, and how much light comes from it.

#include <optional>
#include <vector>

#include "roxel/sky/sphere_light.h"

namespace roxel {

struct FoundSun {
  Eigen::Vector3d direction;  ///< unit, sky frame
  double contrast = 0;    ///< its peak over the median luminance above the horizon; clipped: a lower bound
  bool clipped = false;   ///< direction is the middle of a clipped patch
  double radius_deg = 0;  ///< of the patch or cluster
};

/// The brightest cluster above the horizon. None where nothing stands out: no clipped patch under 15 degrees
/// across, and no pixel 12 times brighter than the median.
std::optional<FoundSun> find_sun(const SphereLight& light);

/// All clipped spots that are small enough to be the sun and its glare, however little of a facet they are;
/// largest first.
std::vector<FoundSun> clipped_spots(const SphereLight& light);

/// What a picture tells of the light of a sun in a known direction.
struct SunMeasure {
  bool in_view = false;  ///< with a margin of twice the radius that is summed over
  bool clipped = false;
  bool shines = false;  ///< much brighter than what is around it
  Eigen::Vector3d irradiance =
      Eigen::Vector3d::Zero();  ///< on a surface that faces it, sky around it taken off
};

/// Sums radiance over a small disc around the sun (unit, sky frame).
SunMeasure measure_sun(const SkyPicture& picture, const Eigen::Vector3d& sun);

}  // namespace roxel

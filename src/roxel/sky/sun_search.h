#pragma once
/// The sun as pictures show it: where the brightest cluster of facets is, and how much light comes from it.

#include <cstdint>
#include <vector>

#include "roxel/sky/sphere_light.h"

namespace roxel {

struct FoundSun {
  Eigen::Vector3d direction;  ///< unit, sky frame
  double contrast = 0;    ///< the peak over the median luminance above the horizon; clipped: a lower bound
  double peak = 0;        ///< highest luminance of all
  bool clipped = false;   ///< direction is the middle of a clipped patch
  double radius_deg = 0;  ///< of the patch or cluster: its farthest facet from the middle
};

/// What may be the sun: where the brightest facet clips, patches up to 20 degrees from their middle to their
/// edge, of facets that clip for more than half, then of those that clip at all (a small sun, but also the
/// sun and a wall together), each largest first; then the brightest cluster above the horizon, if it is 12
/// times brighter than the median. Lamps, windows and sunlit walls are among them.
std::vector<FoundSun> bright_spots(const SphereLight& light);

/// Part of the sphere, from one distance to another around a direction.
struct SkyRing {
  double sky_share = 0;   ///< of its area
  double seen_share = 0;  ///< of what of it is above the horizon
  double luminance = 0;   ///< mean of what of it is sky
};
SkyRing sky_ring(const SphereLight& light, const std::vector<std::uint8_t>& sky,
                 const Eigen::Vector3d& direction, double inner_deg, double outer_deg);

/// Whether a spot is a sun, however little it stands out where white is 1: pictures show all that is around
/// it, it stands amid sky (1 a facet), and that is much brighter beside it than further away.
bool glares(const SphereLight& light, const std::vector<std::uint8_t>& sky, const FoundSun& spot);

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

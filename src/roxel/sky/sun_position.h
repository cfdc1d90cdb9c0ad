#pragma once
/// Where the sun stands.

#include <Eigen/Core>

namespace roxel {

struct SunPosition {
  double azimuth_deg;    ///< clockwise from north, [0, 360)
  double elevation_deg;  ///< of the disc's middle above the horizon, without refraction
};

/// At a time (seconds since 1970-01-01T00:00:00Z) and place (degrees; north and east are positive). Right to
/// 0.01 degrees for 1950 to 2050: the sun's parallax (0.0024 degrees) is left out.
SunPosition sun_position(double time_utc_s, double latitude_deg, double longitude_deg);

/// Unit vector to the sun: X east, Y north, Z up.
Eigen::Vector3d sun_direction(const SunPosition& sun);

}  // namespace roxel

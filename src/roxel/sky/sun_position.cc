#include "roxel/sky/sun_position.h"

#include <libnova/nutation.h>
#include <libnova/precession.h>
#include <libnova/solar.h>
#include <libnova/transform.h>

#include <cmath>
#include <mutex>
#include <numbers>

namespace roxel {
namespace {

/// libnova keeps its last results in static variables without locks, and takes the nutation of a tenth of a
/// day ago for that of now: one call at a time, each after a day that is far away, depends on nothing before.
class LoneCall {
 public:
  explicit LoneCall(double julian_day) : lock_(mutex()) {
    ln_nutation far_away;
    ln_get_nutation(julian_day + 1000, &far_away);
  }

 private:
  static std::mutex& mutex() {
    static std::mutex one_at_a_time;
    return one_at_a_time;
  }
  std::lock_guard<std::mutex> lock_;
};

}  // namespace

SunPosition sun_position(double time_utc_s, double latitude_deg, double longitude_deg) {
  constexpr double kJulianDayOf1970 = 2440587.5, kDay = 86400;
  const double julian_day = kJulianDayOf1970 + time_utc_s / kDay;
  const LoneCall lone(julian_day);
  // libnova's sun is on the equator of 2000; a quarter of a degree is between that and today's.
  ln_equ_posn sun_of_2000, sun;
  ln_get_solar_equ_coords(julian_day, &sun_of_2000);
  ln_get_equ_prec(&sun_of_2000, julian_day, &sun);
  ln_lnlat_posn observer{longitude_deg, latitude_deg};
  ln_hrz_posn seen;
  ln_get_hrz_from_equ(&sun, &observer, julian_day, &seen);
  // libnova counts azimuths from the south.
  return {std::fmod(seen.az + 180, 360), seen.alt};
}

Eigen::Vector3d sun_direction(const SunPosition& sun) {
  const double azimuth = sun.azimuth_deg * std::numbers::pi / 180;
  const double elevation = sun.elevation_deg * std::numbers::pi / 180;
  return {std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth),
          std::sin(elevation)};
}

}  // namespace roxel

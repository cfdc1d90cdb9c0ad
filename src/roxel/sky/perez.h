#pragma once
/// The all-weather sky [Perez93]: how bright each direction of the dome is, given where the sun stands.
///
///     f(theta, phi) = [1 + a exp(b / cos theta)] [1 + c exp(d phi^h) + e cos^2 phi]
///
/// theta is the angle from the zenith, phi from the sun, both in radians. h = 1 is the published model;
/// [Jethwa04] eq. (3.2) frees it. Radiance is L_z f, one set of parameters a colour channel.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

namespace roxel {

struct PerezShape {
  double a = 0;   ///< gradation from zenith to horizon: below 0 the horizon is darker, above 0 brighter
  double b = -1;  ///< its width, b <= 0
  double c = 0;   ///< brightness around the sun
  double d = -1;  ///< its width, d <= 0
  double e = 0;   ///< light scattered back, opposite to the sun
  double h = 1;

  bool operator==(const PerezShape&) const = default;
};

/// One channel: radiance = scale x f.
struct PerezChannel {
  PerezShape shape;
  double scale = 0;  ///< L_z > 0, in the unit of the images

  bool operator==(const PerezChannel&) const = default;
};

/// Directions nearer to the horizon than this sine of elevation (0.6 degrees) count as this: 1 / cos theta
/// has no bounds.
inline constexpr double kLowestSine = 0.01;

/// f of the parameters {a, b, c, d, e, h}, for doubles and for numbers that carry derivatives.
template <class T>
T perez_relative(const T* abcdeh, double cos_theta, double phi) {
  using std::exp;
  using std::pow;
  const double cos_z = std::max(cos_theta, kLowestSine);
  const double cos_phi = std::cos(phi);
  const T glow = phi > 0 ? exp(abcdeh[3] * pow(T(phi), abcdeh[5])) : T(1);
  return (1.0 + abcdeh[0] * exp(abcdeh[1] / cos_z)) *
         (1.0 + abcdeh[2] * glow + abcdeh[4] * cos_phi * cos_phi);
}

/// f in a direction (unit, Z up); 0 where the print's formula goes below 0.
double perez_relative(const PerezShape& shape, const Eigen::Vector3d& direction, const Eigen::Vector3d& sun);

/// The published sky of a bin.
inline constexpr int kClearnessBins = 8;

/// Lower ends of the bins of clearness, 1 (overcast) to 6.2 (clear) [Perez93] table 1.
extern const std::array<double, kClearnessBins> kClearness;

/// [Perez93] eq. (6) to (8) with table 1: the shape at a bin (0 to 7), the sun's angle from the zenith
/// (radians) and a brightness (0.05 dark to 0.5 bright). Throws std::logic_error for another bin.
PerezShape published_perez(int bin, double sun_zenith_rad, double brightness);

/// A brightness that is usual in a bin: bright clouds in the middle, dark blue at the end.
double usual_brightness(int bin);

}  // namespace roxel

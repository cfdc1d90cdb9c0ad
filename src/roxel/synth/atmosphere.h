#pragma once
/// Radiance of a clear sky from first principles: sunlight scattered by air and haze and absorbed by ozone in
/// a spherical atmosphere over dark ground, in three bands around 680, 550 and 440 nm that stand for linear
/// red, green and blue. Light is scattered once exactly, and more often as if evenly in all directions
/// [Hillaire20]. The observer stands at sea level.

#include <Eigen/Core>
#include <vector>

namespace roxel {

class Atmosphere {
 public:
  /// `haze_depth` is the optical depth of aerosols straight up: 0.02 is mountain air, 0.3 a murky day. The
  /// sun's irradiance outside the atmosphere is 1 in each band.
  explicit Atmosphere(double haze_depth);

  /// Share of the light that comes from outside to the observer from a direction with this sine of
  /// elevation; 0 from below the horizon.
  Eigen::Vector3d transmittance(double sin_elevation) const { return transmittance(0, sin_elevation); }

  /// From a unit direction above the horizon (Z up), without the sun's disc.
  Eigen::Vector3d radiance(const Eigen::Vector3d& direction, const Eigen::Vector3d& to_sun) const;

 private:
  struct Medium;
  Medium medium(double height_km) const;
  Eigen::Vector3d transmittance(double height_km, double mu) const;
  Eigen::Vector3d multiple(double height_km, double mu_sun) const;
  Eigen::Vector3d march_transmittance(double height_km, double mu) const;
  void march_multiple(double height_km, double mu_sun, Eigen::Vector3d& once, Eigen::Vector3d& again) const;
  void tabulate_transmittance();
  void tabulate_multiple();

  double haze_scattering_, haze_extinction_;  ///< per kilometre at sea level
  std::vector<Eigen::Vector3d> transmittance_, multiple_;
};

}  // namespace roxel

#pragma once
/// Light from all around: a sky as a map of radiance over directions, and a sun apart from it.
///
/// Maps are equirectangular: row 0 is the zenith, the centre column north (+Y), to the right is east (+X);
/// azimuth = (u / width - 1/2) 360 degrees clockwise from north, elevation = (1/2 - v / height) 180 degrees,
/// pixel centres at + 0.5.

#include <Eigen/Core>
#include <functional>

#include "roxel/image/image.h"

namespace roxel {

/// Unit direction of a map's position (u, v) in pixels, and the position of a direction.
Eigen::Vector3f map_direction(const Image& map, float u, float v);
Eigen::Vector2f map_position(const Image& map, const Eigen::Vector3f& direction);

struct Sun {
  Eigen::Vector3f direction = Eigen::Vector3f::UnitZ();  ///< unit, to the sun
  Eigen::Vector3f irradiance = Eigen::Vector3f::Zero();  ///< on a surface that faces it; zero = no sun
  float angular_radius_rad = 0.00476f;                   ///< 0.2725 degrees
  /// Radiance of the disc, all of one brightness.
  Eigen::Vector3f radiance() const;
};

class Environment {
 public:
  static constexpr int kWidth = 512, kHeight = 256;

  /// `radiance` of every direction apart from the sun's disc, sampled at the map's pixel centres.
  Environment(const std::function<Eigen::Vector3f(const Eigen::Vector3f& direction)>& radiance,
              const Sun& sun);

  const Sun& sun() const { return sun_; }
  const Image& map_without_disc() const { return map_; }
  /// The map with the disc's light spread over the pixels that it covers.
  Image map_with_disc() const;

  /// Radiance from a direction without the sun's disc, interpolated.
  Eigen::Vector3f sky(const Eigen::Vector3f& direction) const;
  /// The same with the disc, as a camera sees it.
  Eigen::Vector3f seen(const Eigen::Vector3f& direction) const;
  /// On a horizontal surface from the sky alone, and from sky and sun.
  Eigen::Vector3f sky_irradiance() const;
  Eigen::Vector3f total_irradiance() const;

 private:
  Image map_;
  Sun sun_;
};

}  // namespace roxel

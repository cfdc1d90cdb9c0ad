#pragma once
/// For tests: a square under a known sky, as a panorama.

#include <cmath>

#include "roxel/base/angles.h"
#include "roxel/sky/sky_fit.h"

namespace roxel {

inline NodeSky clear_sky(double sun_azimuth = 150, double sun_elevation = 40) {
  NodeSky sky;
  sky.model = SkyModel::kPerez;
  sky.sun = sun_direction({sun_azimuth, sun_elevation});
  sky.sun_source = SunSource::kGiven;
  sky.channels = {PerezChannel{{-1.01, -0.15, 25, -5, 0.9, 1}, 0.15},
                  PerezChannel{{-1.02, -0.23, 14, -5, 0.95, 1}, 0.14},
                  PerezChannel{{-1.06, -0.45, 6, -5, 1, 1}, 0.13}};
  sky.sun_light = SunLight::kMeasured;
  sky.sun_irradiance = {3.3, 2.7, 2.2};
  return sky;
}

inline NodeSky overcast_sky() {
  NodeSky sky = clear_sky();
  for (PerezChannel& channel : sky.channels) channel = {{4, -0.7, 0, -1, 0, 1}, 0.05};
  sky.sun_light = SunLight::kNone;
  sky.sun_irradiance.setZero();
  return sky;
}

/// A number that looks random but is not, in [-1, 1].
inline float unrest(int x, int y) {
  unsigned h = static_cast<unsigned>(x) * 2654435761u ^ (static_cast<unsigned>(y) * 40503u + 977u);
  h ^= h >> 13, h *= 0x5bd1e995u, h ^= h >> 15;
  return static_cast<float>(h % 2001) / 1000.0f - 1.0f;
}

struct Square {
  double roof_deg = 15;  ///< height of the walls around, above the horizon
  float wall = 0.3f;     ///< mean radiance; texture changes it by a half
  bool window = false;   ///< a smooth patch in the southern wall that mirrors a tenth of the sky
  bool disc = true;
  float noise = 0;  ///< relative, of the sky
};

/// The wall's `surface` is 255 in the picture's true mask.
inline SkyPicture panorama_of(const NodeSky& sky, const Square& square, Mask* surface = nullptr) {
  const Equirectangular frame{360, 180};
  SkyPicture picture{
      sky_map(sky, square.disc ? Disc::kWith : Disc::kWithout, 360, 180), {}, {}, PixelRays(frame)};
  if (surface) *surface = Mask(360, 180, 0);
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 360; ++x) {
      const Eigen::Vector3d d = frame.direction(x + 0.5, y + 0.5);
      float* rgb = picture.rgb.pixel(x, y);
      if (std::asin(d.z()) / kDegree > square.roof_deg) {
        for (int c = 0; c < 3; ++c) rgb[c] *= 1 + square.noise * unrest(x, y);
        continue;
      }
      if (surface) surface->at(x, y) = 255;
      const bool window = square.window && std::abs(x - 180) < 8 && y > 76 && y < 88;
      const Eigen::Vector3d mirrored = 0.1 * sky.radiance_in_sky({d.x(), d.y(), std::abs(d.z())});
      const float wall = square.wall * (1 + 0.5f * unrest(x, y));
      for (int c = 0; c < 3; ++c)
        rgb[c] = window ? static_cast<float>(mirrored[c]) : wall * (c == 0 ? 1.1f : c == 1 ? 1.0f : 0.8f);
    }
  picture.clip = clip_level(picture.rgb);
  return picture;
}

inline SkyFit fit_one(const SkyPicture& picture, SkyFitOptions options = {}, SkyTask task = {}) {
  options.facet_level = std::min(options.facet_level, 5);
  task.name = "n00";
  task.views = {"a"};
  return fit_sky(
      task, [&](int) { return picture; }, options);
}

}  // namespace roxel

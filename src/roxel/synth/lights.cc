#include "roxel/synth/lights.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>

#include "roxel/base/angles.h"
#include "roxel/base/parallel.h"
#include "roxel/sky/sun_position.h"
#include "roxel/synth/atmosphere.h"
#include "roxel/synth/blend.h"
#include "roxel/synth/noise.h"

namespace roxel {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float kSunOutside = 3.5f;     // irradiance outside the atmosphere
constexpr float kGroundAlbedo = 0.18f;  // of the land around, as it is seen below the horizon

/// Where a direction meets a layer of cloud, in its thicknesses; the layer sinks with the horizon.
Vector3f in_layer(const Vector3f& d) {
  const float z = std::max(d.z(), 0.0f) + 0.08f;
  return {2.5f * d.x() / z, 2.5f * d.y() / z, 0};
}

/// Opacity of scattered clouds, 0 to 1. The sun stands in a gap between them.
float cloud_opacity(const Vector3f& d, const Vector3f& to_sun, const Weather& weather) {
  const float gap = ramp(0.06f, 0.3f, (d - to_sun).norm());
  const float noise = fractal_noise(in_layer(d), 6, weather.seed);
  const float threshold = 0.45f * (1 - 2 * static_cast<float>(weather.cloud_cover));
  return ramp(threshold, threshold + 0.18f, noise) * ramp(0.0f, 0.06f, d.z()) * gap;
}

/// Light on horizontal ground under a clear sky, by the light of a few rings of directions.
Vector3f clear_irradiance(const Atmosphere& air, const Vector3d& to_sun) {
  constexpr int kRows = 12, kTurns = 24;
  Vector3d sum = Vector3d::Zero();
  for (int row = 0; row < kRows; ++row)
    for (int turn = 0; turn < kTurns; ++turn) {
      const double sin2 = (row + 0.5) / kRows, azimuth = 2 * std::numbers::pi * (turn + 0.5) / kTurns;
      const double flat = std::sqrt(1 - sin2);
      sum += air.radiance({flat * std::cos(azimuth), flat * std::sin(azimuth), std::sqrt(sin2)}, to_sun);
    }
  const Vector3d sky = sum * (std::numbers::pi / (kRows * kTurns));
  return kSunOutside * (sky + std::max(to_sun.z(), 0.0) * air.transmittance(to_sun.z())).cast<float>();
}

/// [MoonSpencer42]: three times as bright in the zenith as at the horizon; with some unrest.
Vector3f overcast_radiance(const Vector3f& d, const Vector3f& irradiance, std::uint32_t seed) {
  const Vector3f zenith = 9 / (7 * kPiFloat) * irradiance;
  const float unrest = 1 + 0.2f * fractal_noise(0.8f * in_layer(d), 4, seed);
  return unrest * (1 + 2 * std::max(d.z(), 0.0f)) / 3 * zenith;
}

Weather weather_of(int occasion, const LightPlan& plan) {
  const auto random = [&](int what) { return lattice_random(occasion, what, 77, plan.seed); };
  Weather weather;
  weather.haze_depth = 0.04 + 0.2 * random(0);
  weather.cloud_cover = 0.3 + 0.25 * random(1);
  weather.cloud_light = 0.15 + 0.2 * random(2);
  weather.seed = lattice_hash(occasion, 3, 77, plan.seed);
  using enum Weather::Kind;
  if (plan.kind == LightKind::kOvercast) weather.kind = kOvercast;
  constexpr Weather::Kind kTurns[] = {kClear, kOvercast, kPartlyCloudy};
  if (plan.kind == LightKind::kMix) weather.kind = kTurns[occasion % 3];
  return weather;
}

/// A horizontal white sheet comes out at four fifths of display white.
float exposure_for(const Environment& environment) {
  return 0.8f * kPiFloat / environment.total_irradiance().mean();
}

WorldLight outdoor_light(int index, UtcSeconds time, const Weather& weather) {
  const SunPosition sun = sun_position(time, kWorldLatitudeDeg, kWorldLongitudeDeg);
  char name[16];
  std::snprintf(name, sizeof name, "n%02d", index);
  WorldLight light{name, daylight(sun_direction(sun).cast<float>(), weather)};
  light.exposure = exposure_for(light.environment);
  light.sky = to_string(weather.kind);
  light.time_utc_s = time;
  return light;
}

}  // namespace

std::string to_string(Weather::Kind kind) {
  if (kind == Weather::Kind::kClear) return "clear";
  return kind == Weather::Kind::kOvercast ? "overcast" : "partly cloudy";
}

Environment daylight(const Vector3f& to_sun, const Weather& weather) {
  const Atmosphere air(weather.haze_depth);
  const Vector3d sun_d = to_sun.cast<double>();
  const Vector3f clear_light = clear_irradiance(air, sun_d);
  const Vector3f grey_light =
      static_cast<float>(weather.cloud_light) * clear_light.mean() * Vector3f(0.94f, 1.0f, 1.07f);
  const bool overcast = weather.kind == Weather::Kind::kOvercast;
  const bool clouds = weather.kind == Weather::Kind::kPartlyCloudy;

  Sun sun;
  sun.direction = to_sun;
  if (!overcast) sun.irradiance = kSunOutside * air.transmittance(sun_d.z()).cast<float>();

  const Vector3f ground = kGroundAlbedo / kPiFloat * (overcast ? grey_light : clear_light);
  const auto radiance = [&](const Vector3f& d) -> Vector3f {
    if (d.z() < 0) return ground;
    if (overcast) return overcast_radiance(d, grey_light, weather.seed);
    const Vector3f clear = kSunOutside * air.radiance(d.cast<double>(), sun_d).cast<float>();
    if (!clouds) return clear;
    // Clouds are lit by all that falls on them, and shine towards us where the sun stands behind them.
    const float glow = 0.55f + 0.9f * std::pow(std::max(d.dot(to_sun), 0.0f), 8.0f);
    const float body = 1 + 0.35f * fractal_noise(3 * in_layer(d), 4, weather.seed + 9);
    const Vector3f cloud = glow * body / kPiFloat * clear_light;
    return clear + cloud_opacity(d, to_sun, weather) * (cloud - clear);
  };
  return Environment(radiance, sun);
}

Environment studio(const Vector3f& to_lamp, float surround) {
  Sun lamp;
  lamp.direction = to_lamp.normalized();
  lamp.irradiance = kPiFloat * Vector3f(0.52f, 0.50f, 0.47f);
  lamp.angular_radius_rad = 0.12f;
  return Environment(
      [&](const Vector3f& d) {
        return Vector3f(surround * (0.40f + 0.16f * d.z()) * Vector3f(0.97f, 1.0f, 1.03f));
      },
      lamp);
}

Lights make_lights(const World& world, const LightPlan& plan, const RunContext& context) {
  Lights lights;
  const int occasions = static_cast<int>(world.times_utc_s.size());
  const bool one = plan.kind == LightKind::kConstant;
  for (int i = 0; i < occasions; ++i) lights.of_occasion.push_back(one ? 0 : i);
  if (one && !world.outdoors) {
    lights.all.push_back({"n00", studio(world.lamp_direction, world.surround)});
    return lights;
  }
  std::vector<std::unique_ptr<WorldLight>> made(one ? 1 : occasions);
  parallel_for(static_cast<std::int64_t>(made.size()), context.thread_count(), [&](std::int64_t index, int) {
    context.throw_if_cancelled();
    const int i = static_cast<int>(index);
    const UtcSeconds time = world.times_utc_s[plan.moving_shadows ? i : 0];
    made[i] = std::make_unique<WorldLight>(outdoor_light(i, time, weather_of(i, plan)));
  });
  for (auto& light : made) lights.all.push_back(std::move(*light));
  return lights;
}

}  // namespace roxel

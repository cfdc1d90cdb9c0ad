#pragma once
/// The light of each occasion of a synthetic world.

#include <optional>
#include <string>
#include <vector>

#include "roxel/base/run_context.h"
#include "roxel/synth/environment.h"
#include "roxel/synth/world.h"

namespace roxel {

struct Weather {
  enum class Kind { kClear, kPartlyCloudy, kOvercast };
  Kind kind = Kind::kClear;
  double haze_depth = 0.1;    ///< optical depth of aerosols straight up
  double cloud_cover = 0.4;   ///< share of a partly cloudy sky
  double cloud_light = 0.25;  ///< share of a clear sky's and its sun's light that a closed layer lets through
  std::uint32_t seed = 1;     ///< of the clouds
};

/// "clear", "partly cloudy", "overcast".
std::string to_string(Weather::Kind kind);

/// Sky and sun outdoors: radiance in units in which the sun outside the atmosphere gives an irradiance
/// of 3.5.
Environment daylight(const Eigen::Vector3f& to_sun, const Weather& weather);
/// A large lamp and a surround that is brighter above: a white surface that faces the lamp has radiance of
/// about 1.
Environment studio(const Eigen::Vector3f& to_lamp, float surround = 1);

struct WorldLight {
  std::string name;  ///< of its files: "n00", "n01", ...
  Environment environment;
  float exposure = 1;  ///< photographs with 8 bits are radiance times this
  std::string sky = "studio";
  std::optional<UtcSeconds> time_utc_s = {};
};

struct LightPlan {
  LightKind kind = LightKind::kConstant;
  bool moving_shadows = true;  ///< else all occasions have the date and time of the first one
  std::uint32_t seed = 1;
};

/// Different lights, and which one each occasion has.
struct Lights {
  std::vector<WorldLight> all;
  std::vector<int> of_occasion;
};

/// On the context's threads; throws Cancelled.
Lights make_lights(const World& world, const LightPlan& plan, const RunContext& context);

}  // namespace roxel

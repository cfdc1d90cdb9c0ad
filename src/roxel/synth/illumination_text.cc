#include "roxel/synth/illumination_text.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "roxel/synth/dataset_text.h"

namespace roxel {
namespace {

using nlohmann::ordered_json;

ordered_json triple(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }

constexpr double kDegrees = 180 / std::numbers::pi;

/// Where the node of an occasion stands.
Eigen::Vector3d node_centre(const World& world, int occasion) {
  const auto shot = std::find_if(world.shots.begin(), world.shots.end(),
                                 [&](const Shot& s) { return s.occasion == occasion; });
  return shot == world.shots.end() ? Eigen::Vector3d::Zero() : shot->camera.pose.centre;
}

/// The light of an occasion.
ordered_json light_json(const World& world, const WorldLight& light, int occasion) {
  const Sun& sun = light.environment.sun();
  const Eigen::Vector3d d = sun.direction.cast<double>();
  const double azimuth = std::atan2(d.x(), d.y()) * kDegrees;
  ordered_json json{{"node", occasion}};
  if (world.occasions_are_nodes) json["center"] = triple(node_centre(world, occasion).cast<float>());
  if (light.time_utc_s) {
    json["time_utc"] = utc_text(*light.time_utc_s);
    json["lat"] = kWorldLatitudeDeg;
    json["lon"] = kWorldLongitudeDeg;
  }
  json["sky"] = light.sky;
  json["sun_azimuth_deg"] = azimuth < 0 ? azimuth + 360 : azimuth;
  json["sun_elevation_deg"] = std::asin(std::clamp(d.z(), -1.0, 1.0)) * kDegrees;
  json["sun_direction"] = triple(sun.direction);
  json["sun_disc"] = !sun.irradiance.isZero();
  json["sun_angular_diameter_deg"] = 2 * sun.angular_radius_rad * kDegrees;
  json["sun_irradiance_normal_rgb"] = triple(sun.irradiance);
  json["sky_irradiance_horizontal_rgb"] = triple(light.environment.sky_irradiance());
  json["total_irradiance_horizontal_rgb"] = triple(light.environment.total_irradiance());
  json["exposure"] = world.high_dynamic_range ? 1.0f : light.exposure;
  json["equirect"] = "sky/" + light.name + ".exr";
  json["equirect_without_disc"] = "sky/" + light.name + "_nosun.exr";
  return json;
}

}  // namespace

std::string illumination_json(const World& world, const Lights& lights) {
  ordered_json root{
      {"lat", kWorldLatitudeDeg},
      {"lon", kWorldLongitudeDeg},
      {"world", "X east, Y north, Z up"},
      {"azimuth", "degrees clockwise from north (+Y)"},
      {"elevation", "degrees above the horizon, without refraction"},
      {"equirect",
       "row 0 = zenith; centre column = north (+Y); to the right = east (+X); az = (u/W - 0.5)*360, "
       "el = (0.5 - v/H)*180, pixel centres at +0.5"},
      {"radiance_units", "linear Rec.709, one factor for all; photographs are radiance times exposure"}};
  root["nodes"] = ordered_json::array();
  // Nodes each have an entry, also where one light is over all; other occasions share it then.
  const bool shared = lights.all.size() < lights.of_occasion.size() && !world.occasions_are_nodes;
  const std::size_t count = shared ? lights.all.size() : lights.of_occasion.size();
  for (std::size_t i = 0; i < count; ++i)
    root["nodes"].push_back(light_json(world, lights.all[lights.of_occasion[i]], static_cast<int>(i)));
  return root.dump(1) + "\n";
}

}  // namespace roxel

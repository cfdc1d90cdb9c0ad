#include "roxel/io/sky_file.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/io/image_file.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* kSkyFormat = "roxel sky";
constexpr int kVersion = 1;
constexpr double kDegrees = 180 / std::numbers::pi;

ordered_json triple(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

ordered_json triples(const std::vector<Eigen::Vector3d>& vectors) {
  ordered_json out = ordered_json::array();
  for (const Eigen::Vector3d& v : vectors) out.push_back(triple(v));
  return out;
}

ordered_json angles(const Eigen::Vector3d& d) {
  const double azimuth = std::atan2(d.x(), d.y()) * kDegrees;
  return {{"azimuth_deg", azimuth < 0 ? azimuth + 360 : azimuth},
          {"elevation_deg", std::asin(std::clamp(d.z(), -1.0, 1.0)) * kDegrees},
          {"direction", triple(d)}};
}

ordered_json optional_angles(const std::optional<Eigen::Vector3d>& d) {
  return d ? angles(*d) : ordered_json(nullptr);
}

template <class T>
ordered_json optional_value(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

ordered_json channel_json(const NodeSky& sky, int c) {
  const PerezChannel& p = sky.channels[c];
  ordered_json out{{"scale", p.scale},
                   {"a", p.shape.a},
                   {"b", p.shape.b},
                   {"c", p.shape.c},
                   {"d", p.shape.d},
                   {"e", p.shape.e},
                   {"h", p.shape.h},
                   {"relative_sigma", sky.relative_sigma[c]},
                   {"residual", sky.residual[c]}};
  return out;
}

ordered_json sun_json(const NodeSky& sky) {
  ordered_json out = angles(sky.sun);
  out["source"] = to_string(sky.sun_source);
  out["by_time"] = optional_angles(sky.sun_by_time);
  out["by_images"] = optional_angles(sky.sun_by_images);
  out["light"] = to_string(sky.sun_light);
  out["irradiance"] = triple(sky.sun_irradiance);
  out["irradiance_relative_sigma"] = sky.sun_relative_sigma;
  return out;
}

ordered_json to_json(const NodeSky& sky) {
  const SkyLight light(sky);
  ordered_json rotation = ordered_json::array();
  for (int row = 0; row < 3; ++row) rotation.push_back(triple(sky.sky_from_world.row(row).transpose()));
  return {{"format", kSkyFormat},
          {"version", kVersion},
          {"node", sky.name},
          {"model", to_string(sky.model)},
          {"fallback", sky.fallback},
          {"time_utc_s", optional_value(sky.time_utc_s)},
          {"latitude_deg", optional_value(sky.latitude_deg)},
          {"longitude_deg", optional_value(sky.longitude_deg)},
          {"sky_from_world", rotation},
          {"sun", sun_json(sky)},
          {"residual_order", sky.residual_order},
          {"red", channel_json(sky, 0)},
          {"green", channel_json(sky, 1)},
          {"blue", channel_json(sky, 2)},
          {"clearness_bin", sky.clearness_bin},
          {"mean_error", sky.mean_error},
          {"inlier_share", sky.inlier_share},
          {"sky_share", sky.sky_share},
          {"clipped_share", sky.clipped_share},
          {"seen_share", sky.seen_share},
          {"mean_disagreement", sky.mean_disagreement},
          {"horizontal_irradiance", triple(light.horizontal_irradiance(Disc::kWith))},
          {"horizontal_irradiance_without_disc", triple(light.horizontal_irradiance(Disc::kWithout))},
          {"mean_radiance", triple(light.mean_radiance(Disc::kWith))},
          {"views", sky.views},
          {"centres", triples(sky.centres)}};
}

/// Reads fields of one object; every complaint names the file and the field.
class Fields {
 public:
  Fields(const json& object, std::string where) : object_(object), where_(std::move(where)) {
    if (!object.is_object()) throw_invalid(where_, object.type_name(), "an object");
  }

  const json& at(const char* key) const {
    const auto found = object_.find(key);
    if (found == object_.end()) throw_invalid(where(key), "nothing", "a value");
    return *found;
  }
  Fields object(const char* key) const { return Fields(at(key), where(key)); }
  std::string where(const char* key) const { return where_ + ": " + key; }

  double number(const char* key) const { return number_of(at(key), key); }
  /// 0 where an older file does not have it.
  double number_or_zero(const char* key) const { return object_.contains(key) ? number(key) : 0; }
  int whole(const char* key, int low, int high) const {
    const double value = number(key);
    if (value != std::floor(value) || value < low || value > high)
      throw_invalid(where(key), at(key).dump(),
                    "a whole number from " + std::to_string(low) + " to " + std::to_string(high));
    return static_cast<int>(value);
  }
  std::optional<double> optional_number(const char* key) const {
    return at(key).is_null() ? std::nullopt : std::optional(number(key));
  }
  std::string text(const char* key) const {
    if (!at(key).is_string()) throw_invalid(where(key), at(key).dump(), "text");
    return at(key).get<std::string>();
  }
  std::vector<double> numbers(const char* key, std::size_t count) const {
    const json& list = at(key);
    if (!list.is_array() || list.size() != count)
      throw_invalid(where(key), list.dump(), std::to_string(count) + " numbers");
    std::vector<double> out;
    for (const json& value : list) out.push_back(number_of(value, key));
    return out;
  }
  Eigen::Vector3d vector(const char* key) const { return Eigen::Vector3d(numbers(key, 3).data()); }
  Eigen::Vector3d direction(const char* key) const {
    const Eigen::Vector3d v = vector(key);
    if (std::abs(v.norm() - 1) > 1e-6) throw_invalid(where(key), at(key).dump(), "a vector of length 1");
    return v;
  }
  /// The value whose name to_string gives, from first to last.
  template <class Enum>
  Enum choice(const char* key, Enum last) const {
    const std::string found = text(key);
    std::string known;
    for (int i = 0; i <= static_cast<int>(last); ++i) {
      const char* name = to_string(static_cast<Enum>(i));
      if (found == name) return static_cast<Enum>(i);
      known += std::string(i ? ", " : "") + name;
    }
    throw_invalid(where(key), "\"" + found + "\"", "one of " + known);
  }

 private:
  double number_of(const json& value, const char* key) const {
    if (!value.is_number() || !std::isfinite(value.get<double>()))
      throw_invalid(where(key), value.dump(), "a finite number");
    return value.get<double>();
  }
  const json& object_;
  std::string where_;
};

void read_channel(const Fields& fields, NodeSky& sky, int c) {
  PerezChannel& p = sky.channels[c];
  p = {{fields.number("a"), fields.number("b"), fields.number("c"), fields.number("d"), fields.number("e"),
        fields.number("h")},
       fields.number("scale")};
  sky.relative_sigma[c] = fields.number("relative_sigma");
  const int order = sky.residual_order;
  sky.residual[c] =
      fields.numbers("residual", order ? static_cast<std::size_t>((order + 1) * (order + 1)) : 0);
}

std::optional<Eigen::Vector3d> read_angles(const Fields& fields, const char* key) {
  if (fields.at(key).is_null()) return std::nullopt;
  return fields.object(key).direction("direction");
}

void read_sun(const Fields& fields, NodeSky& sky) {
  sky.sun = fields.direction("direction");
  sky.sun_source = fields.choice("source", SunSource::kGiven);
  sky.sun_by_time = read_angles(fields, "by_time");
  sky.sun_by_images = read_angles(fields, "by_images");
  sky.sun_light = fields.choice("light", SunLight::kEstimated);
  sky.sun_irradiance = fields.vector("irradiance");
  sky.sun_relative_sigma = fields.number_or_zero("irradiance_relative_sigma");
}

void read_rotation(const Fields& fields, NodeSky& sky) {
  const json& rows = fields.at("sky_from_world");
  const std::string where = fields.where("sky_from_world");
  if (!rows.is_array() || rows.size() != 3) throw_invalid(where, rows.dump(), "three rows of three numbers");
  for (int row = 0; row < 3; ++row) {
    const json wrapped{{"row", rows[row]}};
    sky.sky_from_world.row(row) = Fields(wrapped, where).vector("row").transpose();
  }
  const Eigen::Matrix3d& r = sky.sky_from_world;
  if ((r * r.transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-6 || r.determinant() < 0)
    throw_invalid(where, rows.dump(), "a rotation");
}

/// None in files of older versions.
void read_centres(const json& root, const Fields& fields, NodeSky& sky) {
  if (!root.contains("centres")) return;
  const json& centres = fields.at("centres");
  const std::string where = fields.where("centres");
  if (!centres.is_array() || (!centres.empty() && centres.size() != sky.views.size()))
    throw_invalid(where, centres.dump(), "one place a view, or none");
  for (const json& centre : centres) {
    const json wrapped{{"centre", centre}};
    sky.centres.push_back(Fields(wrapped, where).vector("centre"));
  }
}

NodeSky from_json(const json& root, const std::string& file) {
  const Fields fields(root, file);
  if (fields.text("format") != kSkyFormat)
    throw_invalid(fields.where("format"), root["format"].dump(), "\"roxel sky\"");
  fields.whole("version", kVersion, kVersion);
  NodeSky sky;
  sky.name = fields.text("node");
  sky.model = fields.choice("model", SkyModel::kPerez);
  sky.fallback = fields.text("fallback");
  sky.time_utc_s = fields.optional_number("time_utc_s");
  sky.latitude_deg = fields.optional_number("latitude_deg");
  sky.longitude_deg = fields.optional_number("longitude_deg");
  read_rotation(fields, sky);
  read_sun(fields.object("sun"), sky);
  sky.residual_order = fields.whole("residual_order", 0, 4);
  constexpr const char* kChannels[] = {"red", "green", "blue"};
  for (int c = 0; c < 3; ++c) read_channel(fields.object(kChannels[c]), sky, c);
  sky.clearness_bin = fields.whole("clearness_bin", 0, kClearnessBins - 1);
  sky.mean_error = fields.number("mean_error");
  sky.inlier_share = fields.number_or_zero("inlier_share");
  sky.sky_share = fields.number("sky_share");
  sky.clipped_share = fields.number_or_zero("clipped_share");
  sky.seen_share = fields.number("seen_share");
  sky.mean_disagreement = fields.number("mean_disagreement");
  for (const json& view : fields.at("views")) {
    if (!view.is_string()) throw_invalid(fields.where("views"), view.dump(), "names of views");
    sky.views.push_back(view.get<std::string>());
  }
  read_centres(root, fields, sky);
  return sky;
}

}  // namespace

fs::path sky_path(const fs::path& run, const std::string& node, const std::string& suffix) {
  return run / "sky" / (node + suffix);
}

fs::path sky_mask_path(const fs::path& run, const std::string& view_name) {
  fs::path path = run / "sky" / "mask";
  for (const auto& part : fs::path(view_name).relative_path())
    if (part != "." && part != ".." && !part.empty()) path /= part;
  path += ".png";
  return path;
}

void write_sky(const fs::path& run, const NodeSky& sky) {
  write_exr(sky_path(run, sky.name, ".exr").string(), rgb_channels(sky_map(sky, Disc::kWith)));
  write_exr(sky_path(run, sky.name, "_nosun.exr").string(), rgb_channels(sky_map(sky, Disc::kWithout)));
  write_text_atomically(sky_path(run, sky.name),
                        to_json(sky).dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

NodeSky read_sky(const fs::path& json_file) {
  std::ifstream in(json_file);
  if (!in) throw_invalid(json_file.string(), "no file that can be read", "a sky as roxel sky writes it");
  const json root = json::parse(in, nullptr, false);
  if (root.is_discarded()) throw_invalid(json_file.string(), "no JSON", "a sky as roxel sky writes it");
  return from_json(root, json_file.string());
}

std::vector<NodeSky> read_skies(const fs::path& run) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(run / "sky", error))
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (files.empty()) throw_invalid((run / "sky").string(), "no NODE.json", "a run of roxel sky");
  std::vector<NodeSky> skies;
  for (const fs::path& file : files) {
    skies.push_back(read_sky(file));
    for (std::size_t i = 0; i + 1 < skies.size(); ++i)
      if (skies[i].name == skies.back().name)
        throw_invalid(file.string() + ": node",
                      "\"" + skies.back().name + "\" as another file of the folder has", "one file a node");
  }
  return skies;
}

}  // namespace roxel

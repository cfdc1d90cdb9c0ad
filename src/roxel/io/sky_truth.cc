#include "roxel/io/sky_truth.h"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "roxel/base/error.h"
#include "roxel/base/formatted.h"
#include "roxel/io/image_file.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const json& value_at(const json& node, const char* key, const std::string& where) {
  const auto found = node.find(key);
  if (found == node.end()) throw_invalid(where + "." + key, "nothing", "a value");
  return *found;
}

Eigen::Vector3d triple(const json& node, const char* key, const std::string& where) {
  const json& list = value_at(node, key, where);
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) {
    if (!list.is_array() || list.size() != 3 || !list[i].is_number())
      throw_invalid(where + "." + key, list.dump(), "three numbers");
    v[i] = list[i].get<double>();
  }
  return v;
}

SkyTruth read_node(const json& node, const fs::path& folder, const std::string& where) {
  if (!node.is_object()) throw_invalid(where, node.type_name(), "an object");
  const json &number = value_at(node, "node", where), &map = value_at(node, "equirect_without_disc", where),
             &disc = value_at(node, "sun_disc", where);
  if (!number.is_number_integer()) throw_invalid(where + ".node", number.dump(), "a whole number");
  if (!map.is_string()) throw_invalid(where + ".equirect_without_disc", map.dump(), "a path");
  if (!disc.is_boolean()) throw_invalid(where + ".sun_disc", disc.dump(), "true or false");
  SkyTruth truth;
  truth.node = formatted("n%02d", number.get<int>());
  truth.map_file = folder / map.get<std::string>();
  truth.sun = triple(node, "sun_direction", where);
  truth.disc = disc.get<bool>();
  truth.sun_irradiance = triple(node, "sun_irradiance_normal_rgb", where);
  truth.horizontal = triple(node, "total_irradiance_horizontal_rgb", where);
  truth.horizontal_sky = triple(node, "sky_irradiance_horizontal_rgb", where);
  return truth;
}

}  // namespace

Image SkyTruth::map() const {
  const Image image = read_image(map_file.string(), Response{ResponseCurve::kLinear}).rgb;
  if (image.width() != 2 * image.height())
    throw_invalid(map_file.string(),
                  std::to_string(image.width()) + " x " + std::to_string(image.height()) + " pixels",
                  "a map twice as wide as high");
  return image;
}

bool has_sky_truth(const fs::path& folder) { return fs::is_regular_file(folder / "illumination.json"); }

std::vector<SkyTruth> read_sky_truth(const fs::path& folder) {
  const fs::path file = folder / "illumination.json";
  std::ifstream in(file);
  if (!in) throw_invalid(file.string(), "no file that can be read", "the light of each node");
  const json root = json::parse(in, nullptr, false);
  if (!root.is_object() || !root.contains("nodes") || !root["nodes"].is_array())
    throw_invalid(file.string(), root.is_discarded() ? "no JSON" : "no list \"nodes\"",
                  "the light of each node");
  std::vector<SkyTruth> truths;
  for (std::size_t i = 0; i < root["nodes"].size(); ++i)
    truths.push_back(
        read_node(root["nodes"][i], folder, file.string() + ": nodes[" + std::to_string(i) + "]"));
  return truths;
}

}  // namespace roxel

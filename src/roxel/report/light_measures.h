#pragma once
/// What dividing light out comes to, as JSON, CSV and text. docs/evaluation.md says what each figure is.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "roxel/eval/light_accuracy.h"

namespace roxel {

/// The photographs divided by one kind of light.
struct LightMeasure {
  std::string name;                ///< "none", "sky", "run", "true dome", "true light on the surface"
  std::int64_t shared_places = 0;  ///< that enough nodes see; of them spread.places have every light
  ColorSpread spread;
  LogError albedo;  ///< no pixels where the true albedo is not known
};

nlohmann::ordered_json to_json(const std::vector<LightMeasure>& light);
std::string csv_table(const std::vector<LightMeasure>& light);
/// For a terminal.
std::string to_text(const std::vector<LightMeasure>& light);

}  // namespace roxel

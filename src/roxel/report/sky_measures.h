#pragma once
/// The skies of a run against the true ones, as JSON, CSV and text. docs/evaluation.md says what each figure
/// is.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace roxel {

/// One node. What does not apply, or could not be measured, is empty.
struct SkyMeasure {
  std::string node, model;
  std::optional<double> fit_error;        ///< over the facets that the fit used
  std::optional<double> dome_error;       ///< over the true dome without the disc
  std::optional<double> oracle_error;     ///< of the same model fitted to the true dome
  std::optional<double> sun_error_deg;    ///< of the direction that is used
  std::optional<double> found_error_deg;  ///< of the direction found in the images, where the sun shines
  std::string sun_light;                  ///< none, measured, estimated
  std::optional<double>
      horizontal_error;  ///< of irradiance on the horizontal with the disc, mean over channels
  std::optional<double> horizontal_sky_error;  ///< and without
  std::optional<double> mask_iou;              ///< of all images of the node that have a true mask
  int masks = 0;
};

/// RUN/sky against DIR/illumination.json with its maps, and RUN/sky/mask against DIR/mask. Nodes without
/// truth are left out; empty where no node has any. Throws InvalidInput for broken files.
std::vector<SkyMeasure> measure_skies(const std::filesystem::path& run, const std::filesystem::path& truth,
                                      int threads);

nlohmann::ordered_json to_json(const std::vector<SkyMeasure>& skies);
std::string csv_table(const std::vector<SkyMeasure>& skies);
/// For a terminal.
std::string to_text(const std::vector<SkyMeasure>& skies);

}  // namespace roxel

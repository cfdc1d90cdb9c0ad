#pragma once
/// The skies of a data set as part of a reconstruction: made, or taken from an earlier run.

#include <nlohmann/json.hpp>

#include "roxel/solve/daylight.h"
#include "sky_input.h"

namespace roxel::cli {

/// Fits every sky and writes RUN/sky. Returns what the summary says of each.
std::vector<nlohmann::ordered_json> fit_skies(const SkyInput& input, const SkyOptions& options,
                                              const std::filesystem::path& run, Session& session,
                                              std::vector<std::string>& warnings);

/// The skies of RUN/sky over the views of a data set, matched by the views' names; views that it has none of
/// share their node's. Throws InvalidInput where the run has none, or none for any view, or views of those
/// names stand elsewhere.
Daylight read_daylight(const std::filesystem::path& run, const Dataset& dataset);

/// The loader, with what RUN/sky/mask calls sky as background besides what a mask of its own does; views
/// whose sky is not known have no mask there, and stay as they are. Throws InvalidInput for a mask of another
/// size than its image.
PhotographLoader with_sky_masks(PhotographLoader load, const std::filesystem::path& run);

}  // namespace roxel::cli

#pragma once
/// Pictures of how a sky was found: the sphere as the images show it, each mask, the fitted sky, its error.
/// All directions from the zenith down to 30 degrees below the horizon; north in the middle, east to the
/// right.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "roxel/image/image.h"
#include "roxel/report/html_report.h"
#include "roxel/sky/sky_fit.h"

namespace roxel {

struct SkyPanel {
  std::string name;     ///< of the file: "seen", "variance", "red_blue", "luminance", "used", "fit", "error"
  std::string caption;  ///< for people
  Image picture;        ///< display values
};

/// Error at which its picture is white.
inline constexpr double kHottestSkyError = 0.25;

/// Seven pictures of `width` columns. The masks' pictures show what each takes out: variance red, red over
/// blue yellow, luminance green; "used" tints the facets of the fit blue. Error: black none, white a quarter
/// and more, of all that is seen above the horizon; half as strong, on grey, where the fit did not use it.
std::vector<SkyPanel> sky_panels(const SkyFit& fit, int width = 480);

/// Those pictures for the page, with the reason for the choice of masks.
ReportView sky_report(const SkyFit& fit, const std::vector<SkyPanel>& panels);

/// The same from the files RUN/sky/NODE_NAME.png of the nodes in a summary's "skies"; more nodes than a page
/// shows are thinned out, those without pictures left out.
std::vector<ReportView> sky_reports_of(const std::filesystem::path& run, const nlohmann::ordered_json& skies);

}  // namespace roxel

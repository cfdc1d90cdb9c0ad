#include "roxel/solve/daylight.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "roxel/sky/sky_picture.h"

namespace roxel {

const NodeSky* Daylight::of_view(int view_idx) const {
  const int sky = view_idx < static_cast<int>(sky_of_views.size()) ? sky_of_views[view_idx] : -1;
  return sky >= 0 && why_no_light(skies[sky]).empty() ? &skies[sky] : nullptr;
}

bool Daylight::has_masks() const {
  return std::find(sky_masked.begin(), sky_masked.end(), 1) != sky_masked.end();
}

namespace {

constexpr double kNeutral = 0.8;  ///< red over blue of an overcast dome, at least; blue skies have 0.3 to 0.6
/// Luminance of the zenith over that at 15 degrees: 2.0 to 2.4 under the standard overcast sky, below 1 under
/// clear ones.
constexpr double kOvercastGradation = 1.3;

bool is_evidently_overcast(const NodeSky& sky) {
  const Eigen::Vector3d mean = SkyLight(sky).mean_radiance(Disc::kWithout);
  if (!(mean[0] > kNeutral * mean[2])) return false;
  constexpr double kLow = 15 * 3.14159265358979323846 / 180;
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  for (const auto& [x, y] : {std::pair{1, 0}, {0, 1}, {-1, 0}, {0, -1}})
    low += sky.radiance_in_sky({x * std::cos(kLow), y * std::cos(kLow), std::sin(kLow)}) / 4;
  return luminance(sky.radiance_in_sky(Eigen::Vector3d::UnitZ())) > kOvercastGradation * luminance(low);
}

}  // namespace

std::string why_no_light(const NodeSky& sky) {
  if (!sky.has_light()) return sky.fallback.empty() ? "no sky in view" : sky.fallback;
  if (sky.sun_source == SunSource::kNone && !is_evidently_overcast(sky)) return "sun not known";
  return "";
}

std::string reasons_without_light(const Daylight& daylight) {
  struct Reason {
    int views = 0;
    std::set<std::string> nodes;
  };
  std::map<std::string, Reason> reasons;
  for (const int sky : daylight.sky_of_views) {
    const std::string why = sky < 0 ? "no sky fitted" : why_no_light(daylight.skies[sky]);
    if (why.empty()) continue;
    ++reasons[why].views;
    if (sky >= 0) reasons[why].nodes.insert(daylight.skies[sky].name);
  }
  std::string text;
  for (const auto& [why, reason] : reasons) {
    text += (text.empty() ? "" : ", ") + std::to_string(reason.views) + " " + why;
    std::string names;
    for (const std::string& name : reason.nodes) names += (names.empty() ? "" : ", ") + name;
    if (!names.empty()) text += " (" + names + ")";
  }
  return text;
}

namespace {

/// Of each sky, in one number a channel; zero where none is known.
std::vector<Eigen::Vector3d> light_of_skies(const Daylight& daylight, DomeLight worth) {
  std::vector<Eigen::Vector3d> of_skies;
  for (const NodeSky& sky : daylight.skies)
    of_skies.push_back(!why_no_light(sky).empty()  ? Eigen::Vector3d::Zero()
                       : worth == DomeLight::kMean ? SkyLight(sky).mean_radiance()
                                                   : SkyLight(sky).canonical_light());
  return of_skies;
}

double mean_over_views(const Daylight& daylight, const std::vector<Eigen::Vector3d>& of_skies) {
  double log_sum = 0;
  int lit = 0;
  for (std::size_t v = 0; v < daylight.sky_of_views.size(); ++v) {
    if (!daylight.of_view(static_cast<int>(v))) continue;
    const double bright = luminance(of_skies[daylight.sky_of_views[v]]);
    if (bright > 0) log_sum += std::log(bright), ++lit;
  }
  return lit > 0 ? std::exp(log_sum / lit) : 0;
}

}  // namespace

double mean_light(const Daylight& daylight, DomeLight worth) {
  return mean_over_views(daylight, light_of_skies(daylight, worth));
}

std::vector<std::array<float, 3>> light_of_views(const Daylight& daylight, DomeLight worth) {
  const std::vector<Eigen::Vector3d> of_skies = light_of_skies(daylight, worth);
  const double mean = mean_over_views(daylight, of_skies);
  if (!(mean > 0)) return {};
  std::vector<std::array<float, 3>> of_views(daylight.sky_of_views.size(), {1, 1, 1});
  for (std::size_t v = 0; v < of_views.size(); ++v) {
    if (!daylight.of_view(static_cast<int>(v))) continue;
    const Eigen::Vector3d& seen = of_skies[daylight.sky_of_views[v]];
    if (!(seen.minCoeff() > 0)) continue;
    for (int c = 0; c < 3; ++c) of_views[v][c] = static_cast<float>(seen[c] / mean);
  }
  return of_views;
}

}  // namespace roxel

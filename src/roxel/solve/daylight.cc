#include "roxel/solve/daylight.h"

#include <algorithm>
#include <cmath>

#include "roxel/sky/sky_picture.h"

namespace roxel {

const NodeSky* Daylight::of_view(int view_idx) const {
  const int sky = view_idx < static_cast<int>(sky_of_views.size()) ? sky_of_views[view_idx] : -1;
  return sky >= 0 && skies[sky].has_light() ? &skies[sky] : nullptr;
}

namespace {

/// Of each sky, in one number a channel; zero where none is known.
std::vector<Eigen::Vector3d> light_of_skies(const Daylight& daylight, DomeLight worth) {
  std::vector<Eigen::Vector3d> of_skies;
  for (const NodeSky& sky : daylight.skies)
    of_skies.push_back(!sky.has_light()            ? Eigen::Vector3d::Zero()
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

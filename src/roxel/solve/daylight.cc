#include "roxel/solve/daylight.h"

#include <algorithm>
#include <cmath>

#include "roxel/sky/sky_picture.h"

namespace roxel {

const NodeSky* Daylight::of_view(int view_idx) const {
  const int sky = view_idx < static_cast<int>(sky_of_views.size()) ? sky_of_views[view_idx] : -1;
  return sky >= 0 && skies[sky].has_light() ? &skies[sky] : nullptr;
}

std::vector<std::array<float, 3>> light_of_views(const Daylight& daylight) {
  std::vector<Eigen::Vector3d> of_skies;
  for (const NodeSky& sky : daylight.skies)
    of_skies.push_back(sky.has_light() ? SkyLight(sky).canonical_light() : Eigen::Vector3d::Zero());
  double log_sum = 0;
  int lit = 0;
  const auto light = [&](int view) -> Eigen::Vector3d {
    return daylight.of_view(view) ? of_skies[daylight.sky_of_views[view]] : Eigen::Vector3d::Zero();
  };
  const int views = static_cast<int>(daylight.sky_of_views.size());
  for (int v = 0; v < views; ++v)
    if (const double bright = luminance(light(v)); bright > 0) log_sum += std::log(bright), ++lit;
  if (lit == 0) return {};
  const double mean = std::exp(log_sum / lit);
  std::vector<std::array<float, 3>> of_views(views, {1, 1, 1});
  for (int v = 0; v < views; ++v)
    if (const Eigen::Vector3d seen = light(v); seen.minCoeff() > 0)
      for (int c = 0; c < 3; ++c) of_views[v][c] = static_cast<float>(seen[c] / mean);
  return of_views;
}

}  // namespace roxel

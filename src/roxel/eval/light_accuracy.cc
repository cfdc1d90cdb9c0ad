#include "roxel/eval/light_accuracy.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "roxel/base/parallel.h"
#include "roxel/eval/surface_accuracy.h"

namespace roxel {
namespace {

/// Whether the 3 x 3 pixels around (x, y) are of one surface at about this depth: a slope may double the
/// tolerance from pixel to pixel.
bool inner_pixel(const Image& depth, int x, int y, double z, double tolerance) {
  if (x < 1 || y < 1 || x + 1 >= depth.width() || y + 1 >= depth.height()) return false;
  for (int v = y - 1; v <= y + 1; ++v)
    for (int u = x - 1; u <= x + 1; ++u) {
      const double there = *depth.pixel(u, v);
      if (!(std::abs(there - z) <= 3 * tolerance * z)) return false;
    }
  return std::abs(*depth.pixel(x, y) - z) <= tolerance * z;
}

std::optional<PlaceSighting> sighting_of(const DepthView& view, int view_idx, const Eigen::Vector3d& x,
                                         double tolerance) {
  const Eigen::Vector3d uvz = view.camera.project(x);
  if (!(uvz.z() > 0) || !(uvz.x() >= 1) || !(uvz.y() >= 1) || uvz.x() >= view.depth.width() ||
      uvz.y() >= view.depth.height())
    return std::nullopt;
  const PlaceSighting seen{view_idx, static_cast<int>(uvz.x()), static_cast<int>(uvz.y())};
  return inner_pixel(view.depth, seen.x, seen.y, uvz.z(), tolerance) ? std::optional(seen) : std::nullopt;
}

int count_nodes(std::span<const DepthView> views, const std::vector<PlaceSighting>& sightings) {
  std::vector<int> nodes;
  for (const PlaceSighting& seen : sightings) nodes.push_back(views[seen.view].node);
  std::sort(nodes.begin(), nodes.end());
  return static_cast<int>(std::unique(nodes.begin(), nodes.end()) - nodes.begin());
}

std::vector<SharedPlace> places_of_view(std::span<const DepthView> views, int view_idx,
                                        const SharedPlaceOptions& options) {
  std::vector<SharedPlace> places;
  const DepthView& view = views[view_idx];
  for (int y = options.stride / 2; y < view.depth.height(); y += options.stride)
    for (int x = options.stride / 2; x < view.depth.width(); x += options.stride) {
      const double z = *view.depth.pixel(x, y);
      if (!(z > 0) || !inner_pixel(view.depth, x, y, z, options.tolerance)) continue;
      const Ray ray = view.camera.ray(x + 0.5, y + 0.5);
      SharedPlace place{ray.origin + z * ray.direction, {}};
      for (std::size_t v = 0; v < views.size(); ++v)
        if (const auto seen = sighting_of(views[v], static_cast<int>(v), place.x, options.tolerance))
          place.sightings.push_back(*seen);
      if (count_nodes(views, place.sightings) >= options.least_nodes) places.push_back(std::move(place));
    }
  return places;
}

/// Root mean square over channels of the standard deviation of the nodes' log colours.
double deviation(const std::vector<Eigen::Vector3d>& logs) {
  const auto n = static_cast<double>(logs.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& log : logs) mean += log / n;
  for (const Eigen::Vector3d& log : logs) squares += (log - mean).cwiseAbs2() / (n - 1);
  return std::sqrt(squares.mean());
}

}  // namespace

std::vector<SharedPlace> shared_places(std::span<const DepthView> views, const SharedPlaceOptions& options,
                                       int threads) {
  std::vector<std::vector<SharedPlace>> of_views(views.size());
  parallel_for(static_cast<std::int64_t>(views.size()), threads, [&](std::int64_t v, int) {
    of_views[v] = places_of_view(views, static_cast<int>(v), options);
  });
  std::vector<SharedPlace> places;
  for (std::vector<SharedPlace>& part : of_views)
    std::move(part.begin(), part.end(), std::back_inserter(places));
  return places;
}

std::optional<Eigen::Vector3d> mean_color(const Image& rgb, const PlaceSighting& sighting) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int y = sighting.y - 1; y <= sighting.y + 1; ++y)
    for (int x = sighting.x - 1; x <= sighting.x + 1; ++x)
      for (int c = 0; c < 3; ++c) {
        const float value = rgb.pixel(x, y)[c];
        if (!(value > 0) || !std::isfinite(value)) return std::nullopt;
        sum[c] += value / 9;
      }
  return sum;
}

ColorSpread color_spread(std::span<const DepthView> views, const std::vector<SharedPlace>& places,
                         const PlaceColor& color, int least_nodes) {
  std::vector<double> spreads;
  for (std::size_t p = 0; p < places.size(); ++p) {
    std::map<int, std::pair<Eigen::Vector3d, int>> of_nodes;
    for (std::size_t s = 0; s < places[p].sightings.size(); ++s)
      if (const auto seen = color(p, s)) {
        auto& [sum, count] =
            of_nodes.try_emplace(views[places[p].sightings[s].view].node, Eigen::Vector3d::Zero(), 0)
                .first->second;
        sum += seen->array().log().matrix(), ++count;
      }
    if (static_cast<int>(of_nodes.size()) < least_nodes) continue;
    std::vector<Eigen::Vector3d> logs;
    for (const auto& [node, sum] : of_nodes) logs.push_back(sum.first / sum.second);
    spreads.push_back(deviation(logs));
  }
  ColorSpread spread;
  spread.places = static_cast<std::int64_t>(spreads.size());
  for (const double value : spreads) spread.mean += value / static_cast<double>(spreads.size());
  if (!spreads.empty()) spread.median = quantile(spreads, 0.5);
  return spread;
}

LogError log_error(const std::vector<ColorPair>& pairs) {
  std::vector<Eigen::Array3d> logs;
  double mean = 0;
  for (const ColorPair& pair : pairs) {
    Eigen::Array3d ratio;
    for (int c = 0; c < 3; ++c) ratio[c] = static_cast<double>(pair.estimate[c]) / pair.truth[c];
    if (!(ratio > 0).all() || !ratio.isFinite().all()) continue;
    logs.push_back(ratio.log());
    mean += logs.back().mean();
  }
  LogError error;
  if (logs.empty()) return error;
  mean /= static_cast<double>(logs.size());
  std::vector<double> errors;
  for (const Eigen::Array3d& log : logs) errors.push_back(std::sqrt((log - mean).square().mean()));
  error.pixels = static_cast<std::int64_t>(errors.size());
  for (const double value : errors) error.mean += value / static_cast<double>(errors.size());
  error.median = quantile(errors, 0.5);
  return error;
}

}  // namespace roxel

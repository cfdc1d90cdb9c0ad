#include "sky_stage.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "roxel/base/error.h"
#include "roxel/io/image_file.h"
#include "roxel/io/sky_file.h"

namespace roxel::cli {

namespace fs = std::filesystem;

namespace {

/// Throws InvalidInput where photographs of the skies' names stand elsewhere: then they are others.
void check_places(const std::vector<NodeSky>& skies, const fs::path& run, const Dataset& dataset) {
  constexpr double kSamePlace = 0.01;  // of the extent of all places: cameras may have been adjusted
  std::map<std::string, Eigen::Vector3d> places;
  Eigen::AlignedBox3d extent;
  for (const View& view : dataset.views) {
    places[view.name] = view.camera.pose.centre;
    extent.extend(view.camera.pose.centre);
  }
  const double tolerance = kSamePlace * extent.diagonal().norm() + 1e-9;
  for (const NodeSky& sky : skies)
    for (std::size_t i = 0; i < sky.centres.size(); ++i) {
      const auto found = places.find(sky.views[i]);
      if (found == places.end() || (found->second - sky.centres[i]).norm() <= tolerance) continue;
      const auto text = [](const Eigen::Vector3d& x) {
        std::ostringstream out;
        out << x.x() << ", " << x.y() << ", " << x.z();
        return out.str();
      };
      throw_invalid(sky_path(run, sky.name).string() + ": centres",
                    sky.views[i] + " at " + text(sky.centres[i]),
                    text(found->second) + " as in " + dataset.path + ": skies of other photographs");
    }
}

/// Photographs that no sky was fitted to have that of their node, where its others have but one, unless their
/// time says otherwise.
void give_nodes_their_sky(const Dataset& dataset, Daylight& daylight) {
  for (const Node& node : dataset.nodes) {
    std::set<int> known;
    for (const int v : node.view_idxs)
      if (daylight.sky_of_views[v] >= 0) known.insert(daylight.sky_of_views[v]);
    if (known.size() != 1) continue;
    const std::optional<double>& time = daylight.skies[*known.begin()].time_utc_s;
    for (const int v : node.view_idxs) {
      const std::optional<double>& own = dataset.views[v].time_utc_s;
      if (!time || !own || std::abs(*own - *time) <= kSameSky_s) daylight.sky_of_views[v] = *known.begin();
    }
  }
}

}  // namespace

Daylight read_daylight(const fs::path& run, const Dataset& dataset) {
  Daylight daylight;
  daylight.skies = read_skies(run);
  std::map<std::string, int> sky_of_name;
  for (std::size_t s = 0; s < daylight.skies.size(); ++s)
    for (const std::string& view : daylight.skies[s].views) sky_of_name[view] = static_cast<int>(s);
  check_places(daylight.skies, run, dataset);
  for (const View& view : dataset.views) {
    const auto found = sky_of_name.find(view.name);
    daylight.sky_of_views.push_back(found == sky_of_name.end() ? -1 : found->second);
    daylight.sky_masked.push_back(fs::is_regular_file(sky_mask_path(run, view.name)));
  }
  give_nodes_their_sky(dataset, daylight);
  if (std::all_of(daylight.sky_of_views.begin(), daylight.sky_of_views.end(), [](int s) { return s < 0; }))
    throw_invalid(run.string(), "skies of other photographs",
                  "skies of those of " + dataset.path + ": see roxel sky");
  return daylight;
}

PhotographLoader with_sky_masks(PhotographLoader load, const fs::path& run) {
  return [load = std::move(load), run](const View& view) {
    Photograph photo = load(view);
    const fs::path file = sky_mask_path(run, view.name);
    if (!fs::is_regular_file(file)) return photo;
    Mask sky = read_mask(file.string());
    const int width = photo.rgb.width(), height = photo.rgb.height();
    if (sky.width() != width || sky.height() != height)
      throw_invalid(file.string(),
                    std::to_string(sky.width()) + " x " + std::to_string(sky.height()) + " pixels",
                    std::to_string(width) + " x " + std::to_string(height) + " as " + view.name + " has");
    if (photo.foreground.empty()) photo.foreground = Mask(width, height);
    for (std::size_t i = 0; i < sky.data().size(); ++i)
      photo.foreground.data()[i] =
          std::min<std::uint8_t>(photo.foreground.data()[i], static_cast<std::uint8_t>(255 - sky.data()[i]));
    photo.sky = std::move(sky);
    return photo;
  };
}

}  // namespace roxel::cli

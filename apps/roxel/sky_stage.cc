#include "sky_stage.h"

#include <algorithm>
#include <map>

#include "roxel/base/error.h"
#include "roxel/io/image_file.h"
#include "roxel/io/sky_file.h"

namespace roxel::cli {

namespace fs = std::filesystem;

Daylight read_daylight(const fs::path& run, const Dataset& dataset) {
  Daylight daylight;
  daylight.skies = read_skies(run);
  std::map<std::string, int> sky_of_name;
  for (std::size_t s = 0; s < daylight.skies.size(); ++s)
    for (const std::string& view : daylight.skies[s].views) sky_of_name[view] = static_cast<int>(s);
  for (const View& view : dataset.views) {
    const auto found = sky_of_name.find(view.name);
    daylight.sky_of_views.push_back(found == sky_of_name.end() ? -1 : found->second);
    daylight.sky_masked.push_back(fs::is_regular_file(sky_mask_path(run, view.name)));
  }
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
    const Mask sky = read_mask(file.string());
    const int width = photo.rgb.width(), height = photo.rgb.height();
    if (sky.width() != width || sky.height() != height)
      throw_invalid(file.string(),
                    std::to_string(sky.width()) + " x " + std::to_string(sky.height()) + " pixels",
                    std::to_string(width) + " x " + std::to_string(height) + " as " + view.name + " has");
    if (photo.foreground.empty()) photo.foreground = Mask(width, height);
    for (std::size_t i = 0; i < sky.data().size(); ++i)
      photo.foreground.data()[i] =
          std::min<std::uint8_t>(photo.foreground.data()[i], static_cast<std::uint8_t>(255 - sky.data()[i]));
    return photo;
  };
}

}  // namespace roxel::cli

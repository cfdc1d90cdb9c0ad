#include "sky_input.h"

#include <algorithm>

#include "roxel/base/error.h"
#include "roxel/io/image_file.h"
#include "roxel/solve/memory_plan.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool is_picture(const fs::path& path) {
  if (!fs::is_regular_file(path)) return false;
  const std::string suffix = lower(path.extension().string());
  for (const char* known : {".exr", ".hdr", ".pic", ".tif", ".tiff", ".png", ".jpg", ".jpeg"})
    if (suffix == known) return true;
  return false;
}

/// DIR/NAME.png, by the view's name or its file name alone.
std::optional<fs::path> hand_mask(const std::optional<std::string>& folder, const std::string& name) {
  if (!folder) return std::nullopt;
  for (const std::string& candidate : {name, fs::path(name).filename().string()})
    if (const fs::path file = fs::path(*folder) / (candidate + ".png"); fs::is_regular_file(file))
      return file;
  return std::nullopt;
}

Mask read_hand_mask(const std::optional<std::string>& folder, const std::string& name,
                    std::pair<int, int> size) {
  const auto file = hand_mask(folder, name);
  if (!file) return {};
  Mask mask = read_mask(file->string());
  if (std::pair(mask.width(), mask.height()) != size)
    throw_invalid(file->string(),
                  std::to_string(mask.width()) + " x " + std::to_string(mask.height()) + " pixels",
                  std::to_string(size.first) + " x " + std::to_string(size.second) + " as its image has");
  return mask;
}

void check_hand_masks(const SkyOptions& options, const std::vector<SkyTask>& tasks) {
  if (!options.sky_masks) return;
  for (const SkyTask& task : tasks)
    for (const std::string& view : task.views)
      if (hand_mask(options.sky_masks, view)) return;
  throw_invalid("--sky-masks " + *options.sky_masks, "no mask of any image",
                "NAME.png as images are named, 255 = sky");
}

SkyInput read_panorama(const std::string& path, const InputOptions& input, const SkyOptions& options) {
  std::optional<Response> response;
  if (input.response != "auto") response = parse_response(input.response, "--response");
  ImageFile file = read_image(path, response);
  if (file.rgb.width() != 2 * file.rgb.height())
    throw_invalid(path,
                  std::to_string(file.rgb.width()) + " x " + std::to_string(file.rgb.height()) + " pixels",
                  "a panorama of all directions, twice as wide as high (or a data set)");
  SkyInput sky;
  sky.path = path;
  sky.format = "panorama";
  SkyTask task;
  task.name = fs::path(path).stem().string();
  task.views = {task.name};
  const Equirectangular frame{file.rgb.width(), file.rgb.height()};
  SkyPicture picture{std::move(file.rgb), std::move(file.valid), {}, PixelRays(frame)};
  const std::pair size(picture.rgb.width(), picture.rgb.height());
  picture.known_sky = read_hand_mask(options.sky_masks, task.name, size);
  sky.sizes = {{size}};
  sky.hand_masks.push_back([known = picture.known_sky](int) { return known; });
  picture.clip = clip_level(picture.rgb);
  sky.tasks.push_back(std::move(task));
  sky.pictures.push_back([picture](int) { return picture; });
  return sky;
}

SkyInput read_views(const std::string& path, const InputOptions& input, const SkyOptions& options,
                    const Session& session) {
  SkyInput sky;
  InputOptions reading = input;
  reading.masks = "none";  // masks of objects say nothing of the sky
  sky.input = read_input(path, reading, session);
  const Dataset& dataset = sky.input->dataset;
  sky.path = dataset.path;
  sky.format = dataset.format;
  DatasetSkies skies = sky_tasks(dataset, options.up);
  sky.tasks = std::move(skies.tasks);
  sky.notes = std::move(skies.notes);
  sky.warnings = std::move(skies.warnings);
  for (std::size_t t = 0; t < sky.tasks.size(); ++t) {
    std::vector<View> views;
    std::vector<std::pair<int, int>>& sizes = sky.sizes.emplace_back();
    for (const int v : skies.view_idxs[t]) {
      views.push_back(dataset.views[v]);
      sizes.emplace_back(views.back().camera.intrinsics.width, views.back().camera.intrinsics.height);
    }
    const auto by_hand = sky.hand_masks.emplace_back([views, sizes, folder = options.sky_masks](int i) {
      return read_hand_mask(folder, views[i].name, sizes[i]);
    });
    sky.pictures.push_back(
        [views, by_hand, load = sky.input->load, rotation = sky.tasks[t].sky_from_world](int i) {
          Photograph photograph = load(views[i]);
          return sky_picture(views[i], std::move(photograph), rotation, by_hand(i));
        });
  }
  return sky;
}

}  // namespace

int sky_workers(const SkyInput& input, int threads) {
  std::int64_t largest = 1;
  for (const auto& sizes : input.sizes)
    for (const auto& [width, height] : sizes)
      largest = std::max(largest, static_cast<std::int64_t>(width) * height);
  return roxel::sky_workers(largest, input.most_bytes, threads);
}

SkyInput read_sky_input(const std::string& path, const InputOptions& input, const SkyOptions& options,
                        const Session& session) {
  if (options.sky_masks && !fs::is_directory(*options.sky_masks))
    throw_invalid("--sky-masks " + *options.sky_masks, "no folder", "a folder of masks NAME.png, 255 = sky");
  SkyInput sky =
      is_picture(path) ? read_panorama(path, input, options) : read_views(path, input, options, session);
  check_hand_masks(options, sky.tasks);
  sky.most_bytes = memory_at_hand();
  return sky;
}

}  // namespace roxel::cli

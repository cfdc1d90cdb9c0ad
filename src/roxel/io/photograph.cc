#include "roxel/io/photograph.h"

#include <algorithm>
#include <memory>
#include <mutex>

#include "roxel/base/error.h"
#include "roxel/image/undistort.h"
#include "roxel/io/image_file.h"

namespace roxel {
namespace {

/// The last map that was made: the views of most data sets share one lens.
class MapCache {
 public:
  std::shared_ptr<const UndistortMap> find_or_make(const Lens& lens, const Intrinsics& pinhole) {
    {
      std::lock_guard lock(mutex_);
      if (map_ && lens_ == lens && pinhole_ == pinhole) return map_;
    }
    auto map = std::make_shared<const UndistortMap>(lens, pinhole);
    std::lock_guard lock(mutex_);
    lens_ = lens, pinhole_ = pinhole, map_ = map;
    return map;
  }

 private:
  std::mutex mutex_;
  Lens lens_;
  Intrinsics pinhole_;
  std::shared_ptr<const UndistortMap> map_;
};

std::string in_view(const View& view) { return view.source.empty() ? "" : " (" + view.source + ")"; }

/// Before any pixel is decoded, so that a wrong file costs nothing.
void check_size(const View& view, const std::string& path, const char* what) {
  const ImageSize size = checked_image_size(path, view.source);
  const Intrinsics& expected = view.lens.intrinsics;
  if (size.width == expected.width && size.height == expected.height) return;
  const auto text = [](int w, int h) { return std::to_string(w) + " x " + std::to_string(h) + " pixels"; };
  throw_invalid(path + in_view(view), std::string(what) + " of " + text(size.width, size.height),
                text(expected.width, expected.height) + " as its camera has");
}

/// What the view's mask is made from, in the file's pixels; empty where nothing tells.
Mask stored_foreground(const View& view, const ImageFile& file, MaskUse use) {
  if (use == MaskUse::kNone) return {};
  if (!view.mask_path.empty()) {
    check_size(view, view.mask_path, "a mask");
    return read_mask(view.mask_path);
  }
  const bool opaque = std::ranges::all_of(file.alpha.data(), [](std::uint8_t a) { return a == 255; });
  return opaque ? Mask() : file.alpha;
}

Photograph load(const View& view, const PhotographOptions& options, MapCache& maps) {
  check_size(view, view.image_path, "an image");
  ImageFile file = read_image(view.image_path, options.response);
  const Mask foreground = stored_foreground(view, file, options.masks);
  const auto map = maps.find_or_make(view.lens, view.camera.intrinsics);
  Photograph photograph;
  photograph.valid = map->valid(file.valid);
  if (!photograph.valid.empty() &&
      std::ranges::none_of(photograph.valid.data(), [](auto v) { return v > 0; }))
    throw_invalid(view.image_path + in_view(view), "a lens that leaves no valid pixel of the image",
                  "distortion coefficients that fit it");
  photograph.rgb = map->identity() ? std::move(file.rgb) : map->apply(file.rgb);
  if (!foreground.empty()) photograph.foreground = map->apply(foreground);
  return photograph;
}

}  // namespace

PhotographLoader make_photograph_loader(const PhotographOptions& options) {
  return
      [options, maps = std::make_shared<MapCache>()](const View& view) { return load(view, options, *maps); };
}

}  // namespace roxel

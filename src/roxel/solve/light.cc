#include "roxel/solve/light.h"

#include <cmath>

#include "roxel/image/local_light.h"

namespace roxel {

namespace {
constexpr double kRadians = 3.14159265358979323846 / 180;
}

Image canonical_image(const Photograph& photo, int view_idx, double exposure, const Light& light) {
  Image image = photo.rgb;
  std::array<float, 3> scale = light.of_view(view_idx);
  for (float& s : scale) s = static_cast<float>(1 / (exposure * s));
  std::vector<float>& values = image.data();
  for (std::size_t i = 0; i < values.size(); i += 3)
    for (int c = 0; c < 3; ++c) values[i + c] *= scale[c];
  return image;
}

Image matching_image(const Photograph& photo, int view_idx, double focal_px, double exposure,
                     const Light& light) {
  Image canonical = canonical_image(photo, view_idx, exposure, light);
  if (!light.local_matching) return canonical;
  LocalLightOptions options;
  options.blur_px = focal_px * std::tan(light.blur_deg * kRadians);
  return without_local_light(canonical, photo.valid, photo.foreground, options);
}

}  // namespace roxel

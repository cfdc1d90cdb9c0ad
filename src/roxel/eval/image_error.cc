#include "roxel/eval/image_error.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/error.h"
#include "roxel/color/color_space.h"

namespace roxel {
namespace {

double display_value(float light) {
  return std::isfinite(light) ? srgb_encode(std::clamp(light, 0.0f, 1.0f)) : 0.0;
}

}  // namespace

double ImageError::rms_percent() const {
  return pixel_count > 0 ? 100 * std::sqrt(squared_sum / (3.0 * static_cast<double>(pixel_count))) : 0.0;
}

void ImageError::add(const ImageError& other) {
  squared_sum += other.squared_sum;
  pixel_count += other.pixel_count;
}

ImageError image_error(const Image& render, const Image& photo, const Mask& mask) {
  ROXEL_CHECK_EQ(render.channels(), 3);
  ROXEL_CHECK_EQ(photo.channels(), 3);
  ROXEL_CHECK_EQ(render.width(), photo.width());
  ROXEL_CHECK_EQ(render.height(), photo.height());
  if (!mask.empty()) {
    ROXEL_CHECK_EQ(mask.width(), photo.width());
    ROXEL_CHECK_EQ(mask.height(), photo.height());
  }
  ImageError error;
  for (int y = 0; y < photo.height(); ++y)
    for (int x = 0; x < photo.width(); ++x) {
      if (!mask.empty() && mask.at(x, y) < 128) continue;
      ++error.pixel_count;
      for (int c = 0; c < 3; ++c) {
        const double d = display_value(render.pixel(x, y)[c]) - display_value(photo.pixel(x, y)[c]);
        error.squared_sum += d * d;
      }
    }
  return error;
}

double reprojection_rms(const Image& render, const Image& photo, const Mask& mask) {
  return image_error(render, photo, mask).rms_percent();
}

}  // namespace roxel

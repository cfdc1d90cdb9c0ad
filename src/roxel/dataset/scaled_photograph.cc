#include "roxel/dataset/scaled_photograph.h"

#include <algorithm>
#include <cmath>

namespace roxel {
namespace {

/// Calls do(x, y, u, v) for every pixel (u, v) of the larger image that pixel (x, y) of the smaller holds.
template <class Do>
void for_each_square(int width, int height, int scale, const Do& at) {
  for (int y = 0; y < std::max(1, height / scale); ++y)
    for (int x = 0; x < std::max(1, width / scale); ++x)
      for (int v = y * scale; v < std::min((y + 1) * scale, height); ++v)
        for (int u = x * scale; u < std::min((x + 1) * scale, width); ++u) at(x, y, u, v);
}

/// Pixels of a square, fewer only where the image is smaller than one.
int square_size(int width, int height, int scale) { return std::min(scale, width) * std::min(scale, height); }

/// The two pixels around a position, and how much the second counts.
struct Between {
  int first, second;
  double share;
  Between(double at, int count) {
    const double from = std::clamp(at - 0.5, 0.0, count - 1.0);
    first = static_cast<int>(from);
    second = std::min(first + 1, count - 1);
    share = from - first;
  }
};

}  // namespace

PinholeCamera scaled(PinholeCamera camera, int scale) {
  Intrinsics& k = camera.intrinsics;
  k.width = std::max(1, k.width / scale);
  k.height = std::max(1, k.height / scale);
  for (double* length : {&k.fx, &k.fy, &k.cx, &k.cy, &k.skew}) *length /= scale;
  return camera;
}

Photograph scaled(const Photograph& photo, int scale) {
  if (scale == 1) return photo;
  const int full_width = photo.rgb.width(), full_height = photo.rgb.height(), channels = photo.rgb.channels();
  const int width = std::max(1, full_width / scale), height = std::max(1, full_height / scale);
  Photograph out;
  out.rgb = Image(width, height, channels);
  if (!photo.valid.empty()) out.valid = Mask(width, height, 255);
  for_each_square(full_width, full_height, scale, [&](int x, int y, int u, int v) {
    for (int c = 0; c < channels; ++c) out.rgb.pixel(x, y)[c] += photo.rgb.pixel(u, v)[c];
    if (!photo.valid.empty() && !photo.valid.at(u, v)) out.valid.at(x, y) = 0;
  });
  const auto count = static_cast<float>(square_size(full_width, full_height, scale));
  for (float& value : out.rgb.data()) value /= count;
  return out;
}

Mask scaled(const Mask& mask, int scale) {
  if (scale == 1 || mask.empty()) return mask;
  const int width = std::max(1, mask.width() / scale), height = std::max(1, mask.height() / scale);
  std::vector<int> sums(static_cast<std::size_t>(width) * height);
  for_each_square(mask.width(), mask.height(), scale, [&](int x, int y, int u, int v) {
    sums[static_cast<std::size_t>(y) * width + x] += mask.at(u, v);
  });
  const int count = square_size(mask.width(), mask.height(), scale);
  Mask out(width, height);
  for (std::size_t i = 0; i < sums.size(); ++i)
    out.data()[i] = static_cast<std::uint8_t>((sums[i] + count / 2) / count);
  return out;
}

Mask enlarged(const Mask& mask, int scale, int width, int height) {
  if (scale == 1 || mask.empty()) return mask;
  Mask out(width, height);
  for (int y = 0; y < height; ++y) {
    const Between row((y + 0.5) / scale, mask.height());
    for (int x = 0; x < width; ++x) {
      const Between column((x + 0.5) / scale, mask.width());
      const auto across = [&](int v) {
        return (1 - column.share) * mask.at(column.first, v) + column.share * mask.at(column.second, v);
      };
      out.at(x, y) = static_cast<std::uint8_t>(
          std::lround((1 - row.share) * across(row.first) + row.share * across(row.second)));
    }
  }
  return out;
}

}  // namespace roxel

#include "roxel/image/local_light.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "roxel/base/error.h"

namespace roxel {

namespace {

constexpr int kPlanes = 4;          ///< log R, log G, log B, each times the weight; the weight
constexpr int kBoxes = 3;           ///< three running means are within 3 % of a Gaussian everywhere
constexpr float kFaintest = 1e-4f;  ///< weight of the mean of all pixels: it decides only where no other does

/// Half width of the box whose kBoxes-fold running mean has this standard deviation.
int box_radius(double sigma_px) {
  const double width = std::sqrt(12 * sigma_px * sigma_px / kBoxes + 1);
  return std::max(1, static_cast<int>(std::lround((width - 1) / 2)));
}

/// Running mean over `count` entries that lie `stride` floats apart, kPlanes floats each; beyond the ends
/// nothing counts.
void blur_line(float* line, int count, std::ptrdiff_t stride, int radius,
               std::vector<std::array<float, kPlanes>>& copy) {
  copy.resize(count);
  for (int i = 0; i < count; ++i) std::copy_n(line + i * stride, kPlanes, copy[i].begin());
  std::array<double, kPlanes> sum{};
  const double scale = 1.0 / (2 * radius + 1);
  for (int i = 0; i < std::min(radius, count); ++i)
    for (int p = 0; p < kPlanes; ++p) sum[p] += copy[i][p];
  for (int i = 0; i < count; ++i) {
    for (int p = 0; p < kPlanes; ++p) {
      if (i + radius < count) sum[p] += copy[i + radius][p];
      if (i - radius - 1 >= 0) sum[p] -= copy[i - radius - 1][p];
      line[i * stride + p] = static_cast<float>(sum[p] * scale);
    }
  }
}

void blur(Image& planes, double sigma_px) {
  const int radius = box_radius(sigma_px);
  const std::ptrdiff_t row = std::ptrdiff_t{kPlanes} * planes.width();
  std::vector<std::array<float, kPlanes>> copy;
  for (int box = 0; box < kBoxes; ++box) {
    for (int y = 0; y < planes.height(); ++y)
      blur_line(planes.pixel(0, y), planes.width(), kPlanes, radius, copy);
    for (int x = 0; x < planes.width(); ++x)
      blur_line(planes.pixel(x, 0), planes.height(), row, radius, copy);
  }
}

}  // namespace

Image without_local_light(const Image& rgb, const Mask& valid, const Mask& foreground,
                          const LocalLightOptions& options) {
  ROXEL_CHECK(rgb.channels() == 3 && options.blur_px > 0);
  const std::size_t pixels = rgb.data().size() / 3;
  Image planes(rgb.width(), rgb.height(), kPlanes);
  Image logs = rgb;
  double mean[kPlanes] = {1e-30 * std::log(options.mean_level), 1e-30 * std::log(options.mean_level),
                          1e-30 * std::log(options.mean_level), 1e-30};
  for (std::size_t i = 0; i < pixels; ++i) {
    float weight = 1;
    if (!valid.empty()) weight *= valid.data()[i] / 255.0f;
    if (!foreground.empty()) weight *= foreground.data()[i] / 255.0f;
    float* plane = planes.data().data() + kPlanes * i;
    float* log_i = logs.data().data() + 3 * i;
    for (int c = 0; c < 3; ++c) {
      log_i[c] = std::log(std::max(log_i[c], 0.0f) + options.darkest);
      plane[c] = weight * log_i[c];
    }
    plane[3] = weight;
    for (int p = 0; p < kPlanes; ++p) mean[p] += plane[p];
  }
  for (int c = 0; c < 3; ++c) mean[c] /= mean[3];
  blur(planes, options.blur_px);
  const float tint = static_cast<float>(options.tint);
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* plane = planes.data().data() + kPlanes * i;
    float* out = logs.data().data() + 3 * i;
    float around[3];
    for (int c = 0; c < 3; ++c)
      around[c] = (plane[c] + kFaintest * static_cast<float>(mean[c])) / (plane[3] + kFaintest);
    const float level = (around[0] + around[1] + around[2]) / 3;
    for (int c = 0; c < 3; ++c)
      out[c] = options.mean_level * std::exp(out[c] - (level + tint * (around[c] - level)));
  }
  return logs;
}

}  // namespace roxel

#include "roxel/synth/sky_sampler.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/angles.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// Mean brightness of the map's pixels in a block.
float brightness(const Image& map, int x0, int y0, int width, int height) {
  float sum = 0;
  for (int y = y0; y < y0 + height; ++y)
    for (int x = x0; x < x0 + width; ++x) sum += Eigen::Map<const Vector3f>(map.pixel(x, y)).sum();
  return sum / static_cast<float>(3 * width * height);
}

}  // namespace

float SkySampler::row_bottom(int row) {
  return std::sin((0.5f - static_cast<float>(row + 1) / kRows) * kPiFloat);
}

SkySampler::SkySampler(const Environment& environment) {
  const Image& map = environment.map_without_disc();
  const int width = map.width() / kColumns, height = map.height() / kRows;
  std::vector<float> light;
  double sum = 0;
  float brightest = 0;
  for (int row = 0; row < kRows; ++row) {
    const float solid_angle = kCellAzimuth * (row_bottom(row - 1) - row_bottom(row));
    for (int column = 0; column < kColumns; ++column) {
      const float mean = brightness(map, column * width, row * height, width, height) + 1e-6f;
      brightest = std::max(brightest, mean);
      sum += mean * solid_angle;
      density_.push_back(mean);
      cumulative_.push_back(static_cast<float>(sum));
    }
  }
  for (float& value : density_) value /= static_cast<float>(sum);
  for (float& value : cumulative_) value /= static_cast<float>(sum);
  peak_ = brightest * 4 * kPiFloat / static_cast<float>(sum);
}

Vector3f SkySampler::direction(const Vector2f& random) const {
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end(), random.x());
  const int cell =
      static_cast<int>(std::min<std::ptrdiff_t>(found - cumulative_.begin(), kColumns * kRows - 1));
  const float before = cell > 0 ? cumulative_[cell - 1] : 0.0f, share = cumulative_[cell] - before;
  const float across = share > 0 ? std::clamp((random.x() - before) / share, 0.0f, 1.0f) : 0.5f;
  const int row = cell / kColumns, column = cell % kColumns;
  const float azimuth = (static_cast<float>(column) + across) * kCellAzimuth - kPiFloat;
  const float low = row_bottom(row), up = low + random.y() * (row_bottom(row - 1) - low);
  const float flat = std::sqrt(std::max(0.0f, 1 - up * up));
  return {flat * std::sin(azimuth), flat * std::cos(azimuth), up};
}

float SkySampler::density(const Vector3f& direction) const {
  const float azimuth = std::atan2(direction.x(), direction.y()) + kPiFloat;
  const float elevation = std::asin(std::clamp(direction.z(), -1.0f, 1.0f));
  const int column = std::clamp(static_cast<int>(azimuth / kCellAzimuth), 0, kColumns - 1);
  const int row = std::clamp(static_cast<int>((0.5f - elevation / kPiFloat) * kRows), 0, kRows - 1);
  return density_[row * kColumns + column];
}

}  // namespace roxel

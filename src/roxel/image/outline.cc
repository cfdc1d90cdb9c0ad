#include "roxel/image/outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "roxel/base/error.h"

namespace roxel {

namespace {

constexpr std::uint8_t kBackground = 5, kObject = 250;  ///< at most, at least; files of masks are not exact

/// Whether one of the eight pixels around is all object's.
bool beside_object(const Mask& foreground, int x, int y) {
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, foreground.height() - 1); ++v)
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, foreground.width() - 1); ++u)
      if (foreground.at(u, v) >= kObject) return true;
  return false;
}

/// Of pixels by their value in the mask: `least` where an outline halves the pixel, towards 1 where it hardly
/// touches it.
std::array<double, 256> weights(double least) {
  std::array<double, 256> result;
  for (int share = 0; share < 256; ++share) {
    const double lopsided = 2 * share / 255.0 - 1;
    result[share] = least + (1 - least) * lopsided * lopsided;
  }
  return result;
}

}  // namespace

Mask lighter_on_outline(const Mask& valid, const Mask& foreground, double least) {
  if (foreground.empty() || least == 1) return valid;
  const std::array<double, 256> weight = weights(least);
  Mask result = valid.empty() ? Mask(foreground.width(), foreground.height(), 255) : valid;
  ROXEL_CHECK(result.width() == foreground.width() && result.height() == foreground.height());
  for (int y = 0; y < foreground.height(); ++y)
    for (int x = 0; x < foreground.width(); ++x) {
      const std::uint8_t share = foreground.at(x, y);
      if (share > kBackground && share < kObject && beside_object(foreground, x, y))
        result.at(x, y) = static_cast<std::uint8_t>(std::lround(weight[share] * result.at(x, y)));
    }
  return result;
}

}  // namespace roxel

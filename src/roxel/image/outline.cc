#include "roxel/image/outline.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "roxel/base/error.h"

namespace roxel {

namespace {

constexpr std::uint8_t kBackground = 5, kObject = 250;  ///< at most, at least; files of masks are not exact

}  // namespace

Mask lighter_on_outline(const Mask& valid, const Mask& foreground, double weight) {
  if (foreground.empty() || weight == 1) return valid;
  Mask result = valid.empty() ? Mask(foreground.width(), foreground.height(), 255) : valid;
  ROXEL_CHECK(result.width() == foreground.width() && result.height() == foreground.height());
  for (std::size_t i = 0; i < result.data().size(); ++i) {
    const std::uint8_t share = foreground.data()[i];
    if (share > kBackground && share < kObject)
      result.data()[i] = static_cast<std::uint8_t>(std::lround(weight * result.data()[i]));
  }
  return result;
}

}  // namespace roxel

#include "roxel/image/outline.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "roxel/base/error.h"

namespace roxel {

namespace {

constexpr std::uint8_t kObject = 128;

/// The pixels within a disc, row by row.
class Disc {
 public:
  explicit Disc(double radius) : rows_(static_cast<int>(radius)), radius_(radius) {}

  template <class Visit>
  void around(int x, int y, int width, int height, const Visit& visit) const {
    for (int v = std::max(y - rows_, 0); v <= std::min(y + rows_, height - 1); ++v) {
      const int reach = static_cast<int>(std::sqrt(radius_ * radius_ - (v - y) * (v - y)));
      for (int u = std::max(x - reach, 0); u <= std::min(x + reach, width - 1); ++u) visit(u, v);
    }
  }

 private:
  int rows_;
  double radius_;
};

/// Whether one of the four pixels beside an object's is background.
bool on_outline(const Mask& foreground, int x, int y) {
  const auto background = [&](int u, int v) {
    return u >= 0 && v >= 0 && u < foreground.width() && v < foreground.height() &&
           foreground.at(u, v) < kObject;
  };
  return background(x - 1, y) || background(x + 1, y) || background(x, y - 1) || background(x, y + 1);
}

}  // namespace

Mask lighter_beside_outline(const Mask& valid, const Mask& foreground, double radius_px, double weight) {
  if (foreground.empty() || radius_px < 1 || weight == 1) return valid;
  const int width = foreground.width(), height = foreground.height();
  Mask beside(width, height, 0);
  const Disc disc(radius_px);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (foreground.at(x, y) >= kObject && on_outline(foreground, x, y))
        disc.around(x, y, width, height,
                    [&](int u, int v) { beside.at(u, v) = foreground.at(u, v) < kObject; });
  ROXEL_CHECK(valid.empty() || valid.data().size() == foreground.data().size());
  Mask result = valid.empty() ? Mask(width, height, 255) : valid;
  for (std::size_t i = 0; i < result.data().size(); ++i)
    if (beside.data()[i])
      result.data()[i] = static_cast<std::uint8_t>(std::lround(weight * result.data()[i]));
  return result;
}

}  // namespace roxel

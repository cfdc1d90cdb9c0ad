#include "roxel/surface/atlas.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "roxel/base/error.h"

namespace roxel {
namespace {

/// The upper edge of what is placed: stretches of one height, left to right.
class Skyline {
 public:
  explicit Skyline(int width) : width_(width), steps_{{0, 0}} {}

  void place(AtlasRect& rect) {
    std::size_t best = 0;
    int best_top = std::numeric_limits<int>::max();
    for (std::size_t i = 0; i < steps_.size() && steps_[i].x + rect.width <= width_; ++i) {
      const int top = level(i, rect.width);
      if (top < best_top) best_top = top, best = i;
    }
    rect.x = steps_[best].x;
    rect.y = best_top;
    raise(best, rect.width, best_top + rect.height);
  }

 private:
  struct Step {
    int x, top;
  };

  int end(std::size_t i) const { return i + 1 < steps_.size() ? steps_[i + 1].x : width_; }

  /// The highest of the steps that a rectangle of that width at step i stands on.
  int level(std::size_t first, int width) const {
    int top = 0;
    for (std::size_t i = first; i < steps_.size() && steps_[i].x < steps_[first].x + width; ++i)
      top = std::max(top, steps_[i].top);
    return top;
  }

  void raise(std::size_t first, int width, int top) {
    const int left = steps_[first].x, right = left + width;
    std::size_t last = first;
    while (last < steps_.size() && end(last) <= right) ++last;
    std::vector<Step> with{{left, top}};
    if (last < steps_.size() && steps_[last].x < right) with.push_back({right, steps_[last].top}), ++last;
    steps_.erase(steps_.begin() + static_cast<std::ptrdiff_t>(first),
                 steps_.begin() + static_cast<std::ptrdiff_t>(last));
    steps_.insert(steps_.begin() + static_cast<std::ptrdiff_t>(first), with.begin(), with.end());
  }

  int width_;
  std::vector<Step> steps_;
};

}  // namespace

AtlasSize pack(int width, std::vector<AtlasRect>& rects) {
  std::vector<std::size_t> order(rects.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return rects[a].height != rects[b].height ? rects[a].height > rects[b].height
                                              : rects[a].width > rects[b].width;
  });
  Skyline skyline(width);
  AtlasSize size{width, 0};
  for (const std::size_t i : order) {
    ROXEL_CHECK_LE(rects[i].width, width);
    skyline.place(rects[i]);
    size.height = std::max(size.height, rects[i].y + rects[i].height);
  }
  return size;
}

}  // namespace roxel

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "roxel/dataset/bounds.h"
#include "roxel/dataset/cell_grid.h"

namespace roxel {
namespace {

constexpr int kMaskCells = 48;
constexpr int kRounds = 2;
constexpr std::size_t kMostViews = 120;  // evenly chosen: more of them tell a coarse hull little
constexpr double kBackgroundVeto =
    0.1;                         // share of the views that may call a kept cell background (bad masks)
constexpr double kQuorum = 0.5;  // of the most nodes that see any cell
constexpr std::uint8_t kForeground = 128;

/// Counts of foreground pixels over rectangles, from a running sum: (width + 1) x (height + 1) entries.
class ForegroundSums {
 public:
  explicit ForegroundSums(const Mask& mask)
      : width_(mask.width()),
        height_(mask.height()),
        sums_(static_cast<std::size_t>(width_ + 1) * (height_ + 1), 0) {
    for (int y = 0; y < height_; ++y) {
      std::int32_t row = 0;
      for (int x = 0; x < width_; ++x) {
        row += mask.at(x, y) >= kForeground;
        sums_[index(x + 1, y + 1)] = sums_[index(x + 1, y)] + row;
      }
    }
  }

  /// Whether any pixel within `radius_px` of (u, v) (a square) is foreground.
  bool any_near(double u, double v, double radius_px) const {
    const auto clamp = [](double value, int limit) {
      return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(limit)));
    };
    const int x0 = clamp(std::floor(u - radius_px), width_), x1 = clamp(std::ceil(u + radius_px), width_);
    const int y0 = clamp(std::floor(v - radius_px), height_), y1 = clamp(std::ceil(v + radius_px), height_);
    return sums_[index(x1, y1)] - sums_[index(x0, y1)] - sums_[index(x1, y0)] + sums_[index(x0, y0)] > 0;
  }

 private:
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * (width_ + 1) + x; }
  int width_;
  int height_;
  std::vector<std::int32_t> sums_;
};

struct MaskedView {
  const View* view;
  ForegroundSums sums;
};

std::vector<MaskedView> load_masks(const Dataset& dataset, const PhotographLoader& load) {
  std::vector<MaskedView> masked;
  const std::size_t count = dataset.views.size(), chosen = std::min(count, kMostViews);
  for (std::size_t i = 0; i < chosen; ++i) {
    const View& view = dataset.views[i * count / chosen];
    if (view.mask_path.empty() && !view.has_alpha) continue;
    const Photograph photograph = load(view);
    if (!photograph.foreground.empty()) masked.push_back({&view, ForegroundSums(photograph.foreground)});
  }
  return masked;
}

struct Votes {
  int views = 0;
  int background = 0;
};

Votes vote(const std::vector<MaskedView>& masked, const Eigen::Vector3d& centre, double cell_radius) {
  Votes votes;
  for (const MaskedView& m : masked) {
    const Intrinsics& k = m.view->camera.intrinsics;
    const Eigen::Vector3d pixel = m.view->camera.project(centre);
    if (pixel.z() <= cell_radius) continue;
    if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() > k.width || pixel.y() > k.height) continue;
    ++votes.views;
    votes.background += !m.sums.any_near(pixel.x(), pixel.y(), k.fx * cell_radius / pixel.z());
  }
  return votes;
}

Eigen::AlignedBox3d hull_box(const std::vector<MaskedView>& masked, const CellGrid& grid) {
  const double cell_radius = 0.5 * grid.cell_size().norm();
  std::vector<Votes> votes(grid.cell_count());
  int most = 0;
  for (std::size_t cell = 0; cell < votes.size(); ++cell) {
    votes[cell] = vote(masked, grid.centre(cell), cell_radius);
    most = std::max(most, votes[cell].views);
  }
  return grid.bounds_of([&](std::size_t cell) {
    const Votes& v = votes[cell];
    return v.views > 0 && v.views >= kQuorum * most && v.background <= kBackgroundVeto * v.views;
  });
}

}  // namespace

Eigen::AlignedBox3d tighten_by_masks(const Eigen::AlignedBox3d& box, const Dataset& dataset,
                                     const PhotographLoader& load) {
  const std::vector<MaskedView> masked = load_masks(dataset, load);
  if (masked.empty()) return box;
  Eigen::AlignedBox3d region = box;
  for (int round = 0; round < kRounds; ++round) {
    const CellGrid grid(region, kMaskCells);
    const Eigen::AlignedBox3d hull = hull_box(masked, grid);
    if (hull.isEmpty()) return region;
    // A cell of margin: partly covered cells, and masks that cut a little too much.
    region =
        Eigen::AlignedBox3d(hull.min() - grid.cell_size(), hull.max() + grid.cell_size()).intersection(box);
  }
  return region;
}

}  // namespace roxel

#include "roxel/solve/carve_sky.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "roxel/base/parallel.h"

namespace roxel {
namespace {

constexpr std::uint8_t kSurelySky = 5;  ///< of 255: the most that is still foreground
constexpr double kMarginPixels = 0.5;

/// How many pixels of any rectangle are surely sky: sums over all pixels above and to the left.
class SkyCount {
 public:
  explicit SkyCount(const Photograph& photo)
      : width_(photo.foreground.width()),
        height_(photo.foreground.height()),
        sums_((width_ + 1) * (height_ + 1), 0) {
    for (std::int64_t y = 0; y < height_; ++y)
      for (std::int64_t x = 0; x < width_; ++x) {
        const std::int64_t i = y * width_ + x;
        const bool seen = photo.valid.empty() || photo.valid.data()[i] == 255;  // not beyond the lens
        const bool sky = seen && photo.foreground.data()[i] <= kSurelySky;
        at(x + 1, y + 1) = at(x, y + 1) + at(x + 1, y) - at(x, y) + sky;
      }
  }

  enum class Share { kNone, kSome, kAll };
  /// Of the pixels that the rectangle, and the margin around it, touches; kSome where part is outside the
  /// image.
  Share within(const Eigen::AlignedBox2d& pixels) const {
    const Eigen::Vector2d first = (pixels.min().array() - kMarginPixels).floor();
    const Eigen::Vector2d last = (pixels.max().array() + kMarginPixels).floor() + 1;
    const double left = first.x(), top = first.y(), right = last.x(), bottom = last.y();
    const auto x0 = static_cast<std::int64_t>(std::clamp(left, 0.0, static_cast<double>(width_)));
    const auto y0 = static_cast<std::int64_t>(std::clamp(top, 0.0, static_cast<double>(height_)));
    const auto x1 = static_cast<std::int64_t>(std::clamp(right, 0.0, static_cast<double>(width_)));
    const auto y1 = static_cast<std::int64_t>(std::clamp(bottom, 0.0, static_cast<double>(height_)));
    const std::int64_t sky = x1 > x0 && y1 > y0 ? at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0) : 0;
    if (sky == 0) return Share::kNone;
    const bool inside = left >= 0 && top >= 0 && right <= width_ && bottom <= height_;
    return inside && sky == (x1 - x0) * (y1 - y0) ? Share::kAll : Share::kSome;
  }

 private:
  std::int32_t& at(std::int64_t x, std::int64_t y) { return sums_[y * (width_ + 1) + x]; }
  std::int32_t at(std::int64_t x, std::int64_t y) const { return sums_[y * (width_ + 1) + x]; }

  std::int64_t width_, height_;
  std::vector<std::int32_t> sums_;
};

/// One photograph's view of cubes along the axes.
struct SkyView {
  PinholeCamera camera;
  SkyCount sky;

  SkyCount::Share before(const Eigen::Vector3d& centre, double side) const {
    Eigen::AlignedBox2d pixels;
    int behind = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d off(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
      const Eigen::Vector3d seen = camera.project(centre + side * off);
      if (seen.z() > 0)
        pixels.extend(Eigen::Vector2d(seen.head<2>()));
      else
        ++behind;
    }
    if (behind > 0) return behind == 8 ? SkyCount::Share::kNone : SkyCount::Share::kSome;
    return sky.within(pixels);
  }
};

/// Marks the brick's voxels that are before the sky alone.
void mark(const BrickIndex& index, const Brick& brick, const SkyView& view,
          std::vector<std::uint8_t>& before_sky) {
  const LatticeFrame& frame = index.frame();
  const double size = frame.voxel_size;
  const Eigen::Vector3i first = kBrickSide * brick.coord;
  const Eigen::Vector3d middle =
      0.5 *
      (frame.voxel_centre(first) + frame.voxel_centre(first + Eigen::Vector3i::Constant(kBrickSide - 1)));
  if (view.before(middle, kBrickSide * size) == SkyCount::Share::kNone) return;
  brick.for_each_voxel([&](int v, std::uint32_t slot) {
    const Eigen::Vector3d centre = frame.voxel_centre(voxel_of(brick, v));
    if (!before_sky[slot] && view.before(centre, size) == SkyCount::Share::kAll) before_sky[slot] = 1;
  });
}

}  // namespace

std::int64_t carve_sky(const Dataset& dataset, const PhotographLoader& load,
                       const std::vector<std::uint8_t>& sky_masked, UpdateRule rule,
                       const RunContext& context, Volume& volume) {
  constexpr std::int64_t kGrain = 64;
  std::vector<std::uint8_t> before_sky(volume.slot_count(), 0);
  for (std::size_t v = 0; v < sky_masked.size(); ++v) {
    context.throw_if_cancelled();
    if (!sky_masked[v]) continue;
    const Photograph photo = load(dataset.views[v]);
    if (photo.foreground.empty()) continue;
    const SkyView view{dataset.views[v].camera, SkyCount(photo)};
    for (int lattice = 0; lattice < volume.lattice_count(); ++lattice) {
      const BrickIndex& index = volume.index(lattice);
      parallel_for_blocks(std::ssize(index.bricks()), kGrain, context.thread_count(),
                          [&](std::int64_t begin, std::int64_t end, int) {
                            for (std::int64_t b = begin; b < end; ++b)
                              mark(index, index.bricks()[b], view, before_sky);
                          });
    }
  }
  std::int64_t carved = 0;
  for (std::uint32_t slot = 0; slot < volume.slot_count(); ++slot) {
    if (!before_sky[slot]) continue;
    carved += volume.tau[slot] > 0;
    volume.tau[slot] = 0;
    std::array<float, 2>& support = volume.support[slot];
    support[rule == UpdateRule::kPosterior ? 0 : 1] = 0;  // no opacity by either rule (merge.h)
  }
  return carved;
}

}  // namespace roxel

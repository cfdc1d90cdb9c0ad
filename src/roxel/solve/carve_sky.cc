#include "roxel/solve/carve_sky.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "roxel/base/parallel.h"

namespace roxel {
namespace {

constexpr std::uint8_t kSurelySky = 250;  ///< of 255, at least
constexpr double kMarginPixels = 0.5;
constexpr float kWeak = 0.3f;  ///< opacity below which a voxel is haze rather than surface

/// How many pixels of any rectangle are surely sky: sums over all pixels above and to the left.
class SkyCount {
 public:
  explicit SkyCount(const Photograph& photo)
      : width_(photo.sky.width()), height_(photo.sky.height()), sums_((width_ + 1) * (height_ + 1), 0) {
    for (std::int64_t y = 0; y < height_; ++y)
      for (std::int64_t x = 0; x < width_; ++x) {
        const std::int64_t i = y * width_ + x;
        const bool seen = photo.valid.empty() || photo.valid.data()[i] == 255;  // not beyond the lens
        const bool sky = seen && photo.sky.data()[i] >= kSurelySky;
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

/// Who has seen the sky alone at a voxel: whether one has, or two.
class Witnesses {
 public:
  explicit Witnesses(std::size_t slots) : first_(slots, kNone), two_(slots, 0) {}
  bool are_one(std::uint32_t slot) const { return first_[slot] != kNone; }
  bool are_two(std::uint32_t slot) const { return two_[slot] != 0; }
  void add(std::uint32_t slot, std::int32_t witness) {
    if (first_[slot] == kNone) first_[slot] = witness;
    two_[slot] = first_[slot] != witness;
  }

 private:
  static constexpr std::int32_t kNone = -1;
  std::vector<std::int32_t> first_;
  std::vector<std::uint8_t> two_;
};

/// Notes which of the brick's voxels are before the sky alone.
void look(const BrickIndex& index, const Brick& brick, const SkyView& view, std::int32_t witness,
          Witnesses& witnesses) {
  const LatticeFrame& frame = index.frame();
  const double size = frame.voxel_size;
  const Eigen::Vector3i first = kBrickSide * brick.coord;
  const Eigen::Vector3d middle =
      0.5 *
      (frame.voxel_centre(first) + frame.voxel_centre(first + Eigen::Vector3i::Constant(kBrickSide - 1)));
  if (view.before(middle, kBrickSide * size) == SkyCount::Share::kNone) return;
  brick.for_each_voxel([&](int v, std::uint32_t slot) {
    if (witnesses.are_two(slot)) return;
    if (view.before(frame.voxel_centre(voxel_of(brick, v)), size) == SkyCount::Share::kAll)
      witnesses.add(slot, witness);
  });
}

/// One a view: its node, or where no other node has masks, the view itself.
std::vector<std::int32_t> witnesses_of(const Dataset& dataset, const std::vector<std::uint8_t>& sky_masked) {
  std::vector<std::int32_t> of_views(dataset.views.size());
  std::iota(of_views.begin(), of_views.end(), 0);
  std::vector<std::int32_t> nodes = of_views;
  int masked_nodes = 0;
  for (std::size_t n = 0; n < dataset.nodes.size(); ++n) {
    bool any = false;
    for (const int v : dataset.nodes[n].view_idxs) {
      nodes[v] = static_cast<std::int32_t>(n);
      any |= v < std::ssize(sky_masked) && sky_masked[v] != 0;
    }
    masked_nodes += any;
  }
  return masked_nodes > 1 ? nodes : of_views;
}

}  // namespace

std::int64_t carve_sky(const Dataset& dataset, const PhotographLoader& load,
                       const std::vector<std::uint8_t>& sky_masked, UpdateRule rule,
                       const RunContext& context, Volume& volume) {
  constexpr std::int64_t kGrain = 64;
  Witnesses witnesses(volume.slot_count());
  const std::vector<std::int32_t> witness = witnesses_of(dataset, sky_masked);
  for (std::size_t v = 0; v < sky_masked.size(); ++v) {
    context.throw_if_cancelled();
    if (!sky_masked[v]) continue;
    const Photograph photo = load(dataset.views[v]);
    if (photo.sky.empty()) continue;
    const SkyView view{dataset.views[v].camera, SkyCount(photo)};
    for (int lattice = 0; lattice < volume.lattice_count(); ++lattice) {
      const BrickIndex& index = volume.index(lattice);
      parallel_for_blocks(std::ssize(index.bricks()), kGrain, context.thread_count(),
                          [&](std::int64_t begin, std::int64_t end, int) {
                            for (std::int64_t b = begin; b < end; ++b)
                              look(index, index.bricks()[b], view, witness[v], witnesses);
                          });
    }
  }
  std::int64_t carved = 0;
  for (std::uint32_t slot = 0; slot < volume.slot_count(); ++slot) {
    const bool weak = alpha_from_tau(volume.tau[slot]) < kWeak;
    if (!(weak ? witnesses.are_one(slot) : witnesses.are_two(slot))) continue;
    carved += volume.tau[slot] > 0;
    volume.tau[slot] = 0;
    std::array<float, 2>& support = volume.support[slot];
    support[rule == UpdateRule::kPosterior ? 0 : 1] = 0;  // no opacity by either rule (merge.h)
  }
  return carved;
}

}  // namespace roxel

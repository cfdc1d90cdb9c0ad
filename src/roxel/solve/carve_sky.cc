#include "roxel/solve/carve_sky.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "roxel/base/parallel.h"

namespace roxel {
namespace {

constexpr double kNearlyAll = 0.9;       ///< of a footprint: the rest is an outline's mixed pixels
constexpr double kLeastFootprint = 0.5;  ///< pixels, along each axis
constexpr float kWeak = 0.5f;            ///< opacity below which a voxel is haze rather than surface

/// The mean of a photograph's mask of the sky over any rectangle: sums over all that is above and to the
/// left.
class SkyShare {
 public:
  explicit SkyShare(const Photograph& photo)
      : width_(photo.sky.width()),
        height_(photo.sky.height()),
        sums_(static_cast<std::size_t>(width_ + 1) * (height_ + 1), 0) {
    for (int y = 0; y < height_; ++y) {
      std::uint32_t row = 0;
      for (int x = 0; x < width_; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width_ + x;
        const bool seen = photo.valid.empty() || photo.valid.data()[i] == 255;  // not beyond the lens
        if (seen) row += in_fifteenths(photo.sky.data()[i]);
        at(x + 1, y + 1) = at(x + 1, y) + row;
      }
    }
  }

  /// In [0, 1]; 0 outside the image.
  double within(const Eigen::AlignedBox2d& pixels) const {
    const Eigen::Vector2d half = (0.5 * pixels.sizes()).cwiseMax(0.5 * kLeastFootprint);
    const Eigen::Vector2d first = inside(pixels.center() - half), last = inside(pixels.center() + half);
    const double area = (last - first).prod();
    if (!(area > 0)) return 0;
    const double sum = sum_to(last.x(), last.y()) - sum_to(first.x(), last.y()) -
                       sum_to(last.x(), first.y()) + sum_to(first.x(), first.y());
    return sum / (kFull * area);
  }
  bool has(const Eigen::Vector2d& pixel) const { return inside(pixel) == pixel; }

 private:
  /// Enough, and sums of them fit for 2^28 pixels.
  static constexpr std::uint32_t kFull = 15;
  static std::uint32_t in_fifteenths(std::uint8_t mask) { return (kFull * mask + 127) / 255; }

  Eigen::Vector2d inside(const Eigen::Vector2d& pixel) const {
    return pixel.cwiseMax(0).cwiseMin(Eigen::Vector2d(width_, height_));
  }
  /// Over all that is above and to the left of a position in the image.
  double sum_to(double u, double v) const {
    const int x = std::min(static_cast<int>(u), width_ - 1), y = std::min(static_cast<int>(v), height_ - 1);
    const double fu = u - x, fv = v - y;
    return (1 - fv) * ((1 - fu) * at(x, y) + fu * at(x + 1, y)) +
           fv * ((1 - fu) * at(x, y + 1) + fu * at(x + 1, y + 1));
  }
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * (width_ + 1) + x; }
  std::uint32_t& at(int x, int y) { return sums_[index(x, y)]; }
  std::uint32_t at(int x, int y) const { return sums_[index(x, y)]; }

  int width_, height_;
  std::vector<std::uint32_t> sums_;
};

/// One photograph's view of cubes along the axes.
struct SkyView {
  PinholeCamera camera;
  SkyShare sky;

  struct Footprint {
    Eigen::AlignedBox2d pixels;  ///< the rectangle around the corners before the camera
    int behind = 0;              ///< corners that are not before it
  };
  Footprint footprint(const Eigen::Vector3d& centre, double side) const {
    Footprint print;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d off(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
      const Eigen::Vector3d seen = camera.project(centre + side * off);
      if (seen.z() > 0)
        print.pixels.extend(Eigen::Vector2d(seen.head<2>()));
      else
        ++print.behind;
    }
    return print;
  }

  bool is_before_sky(const Eigen::Vector3d& centre, double side) const {
    const Footprint print = footprint(centre, side);
    return print.behind == 0 && sky.has(camera.project(centre).head<2>()) &&
           sky.within(print.pixels) >= kNearlyAll;
  }
  /// Whether no part of a cube is.
  bool has_no_sky(const Eigen::Vector3d& centre, double side) const {
    const Footprint print = footprint(centre, side);
    return print.behind == 8 || (print.behind == 0 && sky.within(print.pixels) == 0);
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
  if (view.has_no_sky(middle, kBrickSide * size)) return;
  brick.for_each_voxel([&](int v, std::uint32_t slot) {
    if (witnesses.are_two(slot)) return;
    if (view.is_before_sky(frame.voxel_centre(voxel_of(brick, v)), size)) witnesses.add(slot, witness);
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
    const SkyView view{dataset.views[v].camera, SkyShare(photo)};
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

#include "roxel/infer/overlap.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>

#include "roxel/base/parallel.h"

namespace roxel {

namespace {

constexpr int kAcross = 24;  ///< cells along each side of a frame
constexpr int kDeep = 32;    ///< cells along a ray through what is compared, and one for all that lies behind

/// One view's frame, cut into cells that lie behind each other.
class FrameCells {
 public:
  FrameCells(const SampleView& view, const Eigen::AlignedBox3d& box) : view_(view) {
    double nearest = std::numeric_limits<double>::infinity(), farthest = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const auto type = static_cast<Eigen::AlignedBox3d::CornerType>(corner);
      const double depth = view.camera.camera_from_world(box.corner(type)).z();
      nearest = std::min(nearest, depth);
      farthest = std::max(farthest, depth);
    }
    const double deep = std::min(view.plan.range.end, farthest);
    near_ = std::max({nearest, view.plan.range.begin, 1e-3 * deep});
    per_log_ = deep > near_ ? kDeep / std::log(deep / near_) : 0;
    const Intrinsics& k = view.camera.intrinsics;
    const auto edge = [&](double u, double v) { return view.camera.ray(u, v).direction; };
    const std::array<Eigen::Vector3d, 4> edges = {edge(0, 0), edge(k.width, 0), edge(k.width, k.height),
                                                  edge(0, k.height)};
    const Eigen::Vector3d middle = edge(0.5 * k.width, 0.5 * k.height);
    for (int side = 0; side < 4; ++side) {
      const Eigen::Vector3d normal = edges[side].cross(edges[(side + 1) % 4]).normalized();
      sides_[side] = normal.dot(middle) > 0 ? normal : Eigen::Vector3d(-normal);
    }
  }

  /// False where nothing of the ball is in frame.
  bool may_hold(const Eigen::Vector3d& centre, double radius) const {
    const double depth = view_.camera.camera_from_world(centre).z();
    if (depth + radius < view_.plan.range.begin || depth - radius > view_.plan.range.end) return false;
    const Eigen::Vector3d from_eye = centre - view_.camera.pose.centre;
    return std::all_of(sides_.begin(), sides_.end(),
                       [&](const Eigen::Vector3d& inward) { return inward.dot(from_eye) > -radius; });
  }

  /// Whether the point is nearer than all that is compared.
  bool is_before(const Eigen::Vector3d& point) const {
    return view_.camera.camera_from_world(point).z() < near_;
  }

  /// The cell of a point, from the nearest to the farthest of its tile, the last one behind the box; -1 out
  /// of frame.
  int cell(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d at = view_.camera.project(point);
    if (!(at.z() > view_.plan.range.begin && at.z() < view_.plan.range.end)) return -1;
    const Intrinsics& k = view_.camera.intrinsics;
    if (!(at.x() >= 0 && at.x() < k.width && at.y() >= 0 && at.y() < k.height)) return -1;
    const int x = static_cast<int>(kAcross * at.x() / k.width);
    const int y = static_cast<int>(kAcross * at.y() / k.height);
    const int deep =
        per_log_ > 0 ? static_cast<int>(std::clamp(per_log_ * std::log(at.z() / near_), 0.0, double{kDeep}))
                     : kDeep;  // the box is behind the camera
    return (y * kAcross + x) * (kDeep + 1) + deep;
  }

 private:
  const SampleView& view_;
  double near_, per_log_;
  std::array<Eigen::Vector3d, 4> sides_;  ///< unit normals of the frame's sides, inwards, in the world
};

/// A view that has a voxel in frame, and where.
struct Sighting {
  int view, cell;
};

class Overlap {
 public:
  Overlap(const std::vector<SampleNode>& nodes, const Eigen::AlignedBox3d& box)
      : box_(box), node_count_(static_cast<double>(nodes.size())) {
    for (std::size_t n = 0; n < nodes.size(); ++n)
      for (const SampleView& view : nodes[n]) {
        frames_.emplace_back(view, box);
        node_of_.push_back(static_cast<int>(n));
      }
    most_behind_.assign(frames_.size(),
                        std::vector<std::uint16_t>(kAcross * kAcross * (kDeep + 1), std::uint16_t{0}));
  }

  /// Takes in a brick's places inside what is compared; by any number of threads. Once all are in, gather()
  /// them.
  void add_brick(const LatticeFrame& frame, const Eigen::Vector3i& brick, const BrickMask& mask) {
    for_each_voxel(frame, brick, mask,
                   [&](int, const Eigen::Vector3d& centre, const std::vector<int>& views) {
                     if (!box_.contains(centre)) return;
                     std::vector<Sighting> sightings;
                     const int count = sight(centre, views, sightings);
                     for (const Sighting& s : sightings) raise(most_behind_[s.view][s.cell], count);
                   });
  }
  void gather() {
    for (std::vector<std::uint16_t>& cells : most_behind_)
      for (int tile = 0; tile < kAcross * kAcross; ++tile) {
        std::uint16_t* deep = cells.data() + tile * (kDeep + 1);
        deep[kDeep - 1] = std::max(deep[kDeep - 1], deep[kDeep]);  // of its far side itself
        deep[kDeep] = 0;
        for (int d = kDeep - 2; d >= 0; --d) deep[d] = std::max(deep[d], deep[d + 1]);
        most_ = std::max(most_, deep[0]);
      }
  }

  /// The voxels of a brick that are seen too little.
  BrickMask little_seen(const LatticeFrame& frame, const Eigen::Vector3i& brick, const BrickMask& mask,
                        double min_overlap) const {
    const int fewest = std::min<int>(2, most_);
    BrickMask out;
    for_each_voxel(
        frame, brick, mask, [&](int voxel, const Eigen::Vector3d& centre, const std::vector<int>& views) {
          std::vector<Sighting> sightings;
          const int count = sight(centre, views, sightings);
          double behind = 0;
          for (const Sighting& s : sightings) behind += most_behind_[s.view][s.cell];
          behind /= std::max<double>(1, sightings.size());
          out[voxel] = count == 0   ? box_.contains(centre) || hides_all(centre, frame.voxel_size, views)
                       : behind > 0 ? count < fewest || count < nodes_asked_for(behind, min_overlap)
                                    : box_.contains(centre) && count < fewest;
        });
    return out;
  }

 private:
  static void raise(std::uint16_t& entry, int count) {
    const std::uint16_t wanted = static_cast<std::uint16_t>(std::min(count, 0xffff));
    std::atomic_ref<std::uint16_t> value(entry);
    std::uint16_t found = value.load(std::memory_order_relaxed);
    while (found < wanted && !value.compare_exchange_weak(found, wanted, std::memory_order_relaxed)) {
    }
  }

  /// Before a place that `behind` nodes have in frame.
  double nodes_asked_for(double behind, double min_overlap) const {
    const double share = min_overlap * behind;
    return behind >= kMostNodes * node_count_ ? share
                                              : std::min<double>(kLessElsewhere * share, kEnoughNodes);
  }

  /// How many nodes have the point in frame, of those that `views` (ascending) belong to, and where.
  int sight(const Eigen::Vector3d& point, const std::vector<int>& views,
            std::vector<Sighting>& sightings) const {
    int count = 0, last_node = -1;
    for (const int view : views) {
      const int cell = frames_[view].cell(point);
      if (cell < 0) continue;
      sightings.push_back({view, cell});
      if (node_of_[view] != last_node) ++count;
      last_node = node_of_[view];
    }
    return count;
  }

  /// Whether a voxel whose centre no frame holds reaches into some frame before all that is compared.
  bool hides_all(const Eigen::Vector3d& centre, double voxel_size, const std::vector<int>& views) const {
    return std::any_of(views.begin(), views.end(), [&](int view) {
      return frames_[view].may_hold(centre, 0.5 * std::sqrt(3.0) * voxel_size) &&
             frames_[view].is_before(centre);
    });
  }

  /// visit(voxel, its centre, the views that may have it in frame).
  template <class Visit>
  void for_each_voxel(const LatticeFrame& frame, const Eigen::Vector3i& brick, const BrickMask& mask,
                      const Visit& visit) const {
    const Eigen::Vector3i first = kBrickSide * brick;
    const Eigen::Vector3d middle =
        frame.origin +
        frame.voxel_size * (first.cast<double>() + Eigen::Vector3d::Constant(0.5 * kBrickSide));
    const double radius = 0.5 * std::sqrt(3.0) * kBrickSide * frame.voxel_size;
    std::vector<int> views;
    for (std::size_t v = 0; v < frames_.size(); ++v)
      if (frames_[v].may_hold(middle, radius)) views.push_back(static_cast<int>(v));
    for (int voxel = 0; voxel < kBrickVoxels; ++voxel)
      if (mask[voxel])
        visit(voxel,
              frame.voxel_centre(first + Eigen::Vector3i(voxel % kBrickSide, voxel / kBrickSide % kBrickSide,
                                                         voxel / (kBrickSide * kBrickSide))),
              views);
  }

  const Eigen::AlignedBox3d box_;
  const double node_count_;
  std::vector<FrameCells> frames_;
  std::vector<int> node_of_;  ///< ascending
  /// For each view and cell: the most nodes that have a place of the box in frame that is in the cell or
  /// behind.
  std::vector<std::vector<std::uint16_t>> most_behind_;
  std::uint16_t most_ = 0;
};

/// Rays at the frames' rims pass the box by and end behind it.
Eigen::AlignedBox3d grown(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d half = 0.5 * kComparedPlaces * box.sizes();
  return {box.center() - half, box.center() + half};
}

struct PlacedBrick {
  Eigen::Vector3i coord;
  BrickMask mask;
};

std::vector<PlacedBrick> bricks_of(const Topology& lattice) {
  std::vector<PlacedBrick> bricks;
  lattice.for_each_brick([&](const Eigen::Vector3i& coord, const BrickMask& mask) {
    bricks.push_back({coord, mask});
  });
  return bricks;
}

}  // namespace

std::int64_t drop_little_seen(const std::vector<SampleNode>& nodes, const Eigen::AlignedBox3d& box,
                              double min_overlap, const RunContext& context,
                              std::vector<Topology>& lattices) {
  Overlap overlap(nodes, grown(box));
  std::vector<PlacedBrick> bricks;
  for (const Topology& lattice : lattices) {
    bricks = bricks_of(lattice);
    parallel_for(bricks.size(), context.thread_count(), [&](std::int64_t b, int) {
      context.throw_if_cancelled();
      overlap.add_brick(lattice.frame(), bricks[b].coord, bricks[b].mask);
    });
  }
  overlap.gather();
  const std::int64_t before = lattices[0].voxel_count();
  for (Topology& lattice : lattices) {
    bricks = bricks_of(lattice);
    parallel_for(bricks.size(), context.thread_count(), [&](std::int64_t b, int) {
      context.throw_if_cancelled();
      bricks[b].mask = overlap.little_seen(lattice.frame(), bricks[b].coord, bricks[b].mask, min_overlap);
    });
    for (const PlacedBrick& brick : bricks)
      if (brick.mask.any()) lattice.erase_brick(brick.coord, brick.mask);
  }
  return before - lattices[0].voxel_count();
}

}  // namespace roxel

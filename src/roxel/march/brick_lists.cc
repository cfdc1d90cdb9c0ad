#include "roxel/march/brick_lists.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "roxel/base/error.h"
#include "roxel/march/brick_outline.h"

namespace roxel {

namespace {

/// How many bricks from the camera's centre, along each axis.
class BrickDistance {
 public:
  BrickDistance(const LatticeFrame& frame, const Eigen::Vector3d& centre) {
    const double side = kBrickSide * frame.voxel_size;
    for (int a = 0; a < 3; ++a) {
      // Beyond the lattice it does not matter how far.
      const double at = std::floor((centre[a] - frame.origin[a]) / side);
      centre_[a] = static_cast<int>(std::clamp(at, -1.0, static_cast<double>(frame.size_in_bricks[a])));
    }
  }
  std::uint32_t of(const Eigen::Vector3i& brick) const {
    return static_cast<std::uint32_t>((brick - centre_).cwiseAbs().sum());
  }

 private:
  Eigen::Vector3i centre_;
};

/// Whether rays from `centre` come to the brick after `box`, which has no part of it, if they meet both.
bool is_behind(const Eigen::AlignedBox3d& brick, const Eigen::AlignedBox3d& box,
               const Eigen::Vector3d& centre) {
  const Eigen::Vector3d middle = brick.center();
  for (int a = 0; a < 3; ++a) {
    if (middle[a] > box.max()[a] && centre[a] <= box.max()[a]) return true;
    if (middle[a] < box.min()[a] && centre[a] >= box.min()[a]) return true;
  }
  return false;
}

Eigen::AlignedBox3d box_of(const LatticeFrame& frame, const Eigen::Vector3i& brick) {
  const double side = kBrickSide * frame.voxel_size;
  const Eigen::Vector3d low = frame.origin + side * brick.cast<double>();
  return {low, low + Eigen::Vector3d::Constant(side)};
}

/// All bricks in front of the camera, in an order in which no ray meets a later one first.
struct SeenBrick {
  std::uint32_t order;
  std::uint32_t number;
  BrickOutline outline;
};

std::vector<SeenBrick> seen_in_order(const LatticeStack& stack, const PinholeCamera& camera) {
  const Volume& volume = stack.volume();
  const int lattices = volume.lattice_count();
  std::vector<SeenBrick> seen;
  seen.reserve(stack.brick_count());
  std::uint32_t longest = 0;
  for (int k = 0; k < lattices; ++k)
    longest = std::max<std::uint32_t>(longest, volume.index(k).frame().size_in_bricks.sum() + 3);
  for (int k = 0; k < lattices; ++k) {
    const LatticeFrame& frame = volume.index(k).frame();
    const BrickProjection projection(frame, camera);
    const BrickDistance distance(frame, camera.pose.centre);
    std::uint32_t number = stack.first_brick(k);
    for (const Brick& brick : volume.index(k).bricks()) {
      const std::uint32_t here = number++;
      const BrickOutline outline = projection.outline(brick.coord);
      if (outline.depth.end <= 0) continue;
      const bool behind =
          k > 0 && is_behind(box_of(frame, brick.coord), stack.boxes()[k - 1], camera.pose.centre);
      const int stretch = behind ? lattices - 1 + k : lattices - 1 - k;
      seen.push_back({stretch * longest + distance.of(brick.coord), here, outline});
    }
  }
  // By counting: what is equal keeps its place.
  std::vector<std::uint32_t> place((2 * lattices - 1) * longest + 1, 0);
  for (const SeenBrick& brick : seen) ++place[brick.order + 1];
  for (std::size_t i = 1; i < place.size(); ++i) place[i] += place[i - 1];
  std::vector<SeenBrick> sorted(seen.size());
  for (const SeenBrick& brick : seen) sorted[place[brick.order]++] = brick;
  return sorted;
}

/// The squares of samples of one level that a brick is seen in.
struct SquaresOfBrick {
  std::uint32_t number;
  int x0, x1, y0, y1;
};

}  // namespace

BrickLists::BrickLists(const LatticeStack& stack, const PinholeCamera& camera, const SamplePlan& plan)
    : finest_level_(plan.finest_level), levels_(plan.root_level - plan.finest_level + 1) {
  constexpr double kDepth = BrickProjection::kMarginDepth;
  const std::vector<SeenBrick> seen = seen_in_order(stack, camera);
  std::vector<SquaresOfBrick> squares;
  squares.reserve(seen.size());
  double begin = plan.range.begin;
  for (int level = plan.root_level; level >= plan.finest_level; --level) {
    const double end = std::min(plan.range.end, plan.serves_until(level));
    Level& l = levels_[level - finest_level_];
    const double side = std::ldexp(kSide, level);
    const auto count = [side](int size) { return static_cast<int>(std::ceil(size / side)); };
    l.columns = count(camera.intrinsics.width);
    const int rows = count(camera.intrinsics.height);
    l.first.assign(static_cast<std::size_t>(l.columns) * rows + 1, 0);
    squares.clear();
    for (const SeenBrick& brick : seen) {
      const BrickOutline& o = brick.outline;
      if (o.depth.begin * (1 - kDepth) >= end || o.depth.end * (1 + kDepth) <= begin) continue;
      const auto [x0, x1] = BrickProjection::tiles(o.u0, o.u1, side, l.columns);
      const auto [y0, y1] = BrickProjection::tiles(o.v0, o.v1, side, rows);
      if (x0 == x1 || y0 == y1) continue;
      squares.push_back({brick.number, x0, x1, y0, y1});
      for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x) ++l.first[static_cast<std::size_t>(y) * l.columns + x + 1];
    }
    l.first[0] = static_cast<std::uint32_t>(bricks_.size());
    std::size_t entries = bricks_.size();
    for (std::size_t i = 1; i < l.first.size(); ++i) {
      entries += l.first[i];
      l.first[i] += l.first[i - 1];
    }
    ROXEL_CHECK(entries <= std::numeric_limits<std::uint32_t>::max());
    bricks_.resize(l.first.back());
    std::vector<std::uint32_t> next(l.first.begin(), l.first.end() - 1);
    for (const SquaresOfBrick& s : squares)
      for (int y = s.y0; y < s.y1; ++y)
        for (int x = s.x0; x < s.x1; ++x)
          bricks_[next[static_cast<std::size_t>(y) * l.columns + x]++] = s.number;
    begin = std::max(begin, end);
  }
  look_for_empty_squares();
}

void BrickLists::look_for_empty_squares() {
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    Level& l = levels_[i];
    l.none_from.resize(l.first.size() - 1);
    for (std::size_t square = 0; square < l.none_from.size(); ++square)
      l.none_from[square] = l.first[square] == l.first[square + 1];
    if (i == 0) continue;
    const Level& finer = levels_[i - 1];
    for (std::size_t square = 0; square < finer.none_from.size(); ++square)
      if (!finer.none_from[square])
        l.none_from[square / finer.columns / 2 * l.columns + square % finer.columns / 2] = 0;
  }
}

}  // namespace roxel

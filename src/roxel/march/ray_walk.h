#pragma once
/// Traversal of the nested lattices along one ray. The walk yields the existing voxels in ray order and skips
/// empty bricks; what happens in a voxel is the visitor's business, which may also say stop.
///
/// Depths are in units of the ray's direction: distance along the optical axis for rays of
/// PinholeCamera::ray.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "roxel/base/lanes.h"
#include "roxel/camera/camera.h"
#include "roxel/volume/volume.h"

namespace roxel {

/// One existing voxel crossed by a ray.
struct VoxelStep {
  std::uint32_t slot;
  float length;  ///< chord, in voxel lengths of the voxel's lattice
  float weight;  ///< ray weight: 1 through the voxel's centre, 0 at distance sqrt(3)/2 (a vertex), linear
                 ///< between
  float depth;   ///< of the chord's middle
};

/// Where a step's voxel is.
struct VoxelPlace {
  int lattice;
  Eigen::Vector3i voxel;  ///< in the lattice's frame
};

/// A stretch of depths, empty where end <= begin.
struct Stretch {
  double begin;
  double end;
};

/// Depths at which the ray is inside the box (slab method); empty where it misses.
inline Stretch clip_to_box(const Ray& ray, const Eigen::AlignedBox3d& box, Stretch range) {
  for (int axis = 0; axis < 3; ++axis) {
    const double o = ray.origin[axis], d = ray.direction[axis];
    if (d == 0) {
      if (o < box.min()[axis] || o > box.max()[axis]) return {1, 0};
      continue;
    }
    double t0 = (box.min()[axis] - o) / d, t1 = (box.max()[axis] - o) / d;
    if (t0 > t1) std::swap(t0, t1);
    range.begin = std::max(range.begin, t0);
    range.end = std::min(range.end, t1);
  }
  return range;
}

/// A cell of a frame in one word: three fields of 20 bits, x lowest, each the cell's index plus 2^18, so that
/// one add steps over any face, also out of the frame.
using CellCode = std::uint64_t;
namespace internal {
inline constexpr int kCellBits = 20;
inline constexpr int kCellOffset = 1 << 18;  ///< a multiple of the brick's side
inline constexpr CellCode kCellField = (CellCode{1} << kCellBits) - 1;
inline constexpr CellCode kCellUnits = 1 | CellCode{1} << kCellBits | CellCode{1} << 2 * kCellBits;
inline constexpr CellCode kCellInBrick = 7 * kCellUnits;
}  // namespace internal
inline CellCode cell_code(int x, int y, int z) {
  using namespace internal;
  return CellCode(x + kCellOffset) | CellCode(y + kCellOffset) << kCellBits |
         CellCode(z + kCellOffset) << 2 * kCellBits;
}
/// The cell's index along an axis.
inline int cell_index(CellCode code, int axis) {
  using namespace internal;
  return static_cast<int>(code >> axis * kCellBits & kCellField) - kCellOffset;
}
/// voxel_in_brick of the cell: one multiplication brings the fields' low bits side by side.
inline int cell_in_brick(CellCode code) {
  using namespace internal;
  // x's bits end up here, y's and z's above; the other products stay below or fall out.
  constexpr int kTop = 46;
  constexpr CellCode kGather =
      CellCode{1} << kTop | CellCode{1} << (kTop + 3 - kCellBits) | CellCode{1} << (kTop + 6 - 2 * kCellBits);
  return static_cast<int>((code & kCellInBrick) * kGather >> kTop);
}

/// Positions along a ray inside walk_cells are integers: 2^-28 voxel lengths from the ray's origin. All
/// planes between cells lie at first + index * distance exactly, so the compares and adds of the walk's chain
/// of dependent steps are short, and what is found in a cell does not depend on where the walk began.
inline constexpr double kWalkUnit = 1.0 / (1 << 28);

/// What to do with a brick that a walk comes to.
enum class AtBrick { kSkip, kVisit, kStop };

namespace internal {

/// One axis of a walk: where the planes between its cells are.
struct WalkAxis {
  std::int64_t first;     ///< position of plane 0
  std::int64_t distance;  ///< between planes, signed; 0 when the ray runs along them
  int step;               ///< of the cell's index, 0 when the ray runs along the planes
  int bricks;

  static constexpr std::int64_t kNever = std::int64_t{1} << 62;
  /// Position at which the ray leaves cells (cell .. cell + side) of a side that begins at `cell`.
  std::int64_t leaves(int cell, int side) const {
    return step == 0 ? kNever : first + (cell + (step > 0 ? side : 0)) * distance;
  }
  /// The cell at a position, given a guess that is off by rounding at most.
  int correct(int guess, std::int64_t position) const {
    if (step == 0) return guess;
    while (leaves(guess, 1) <= position) guess += step;
    while (leaves(guess - step, 1) > position) guess -= step;
    return guess;
  }
};

}  // namespace internal

/// Amanatides-Woo over the cells of one frame within `range`, which must lie inside the frame's box.
/// `enter(bx, by, bz)` is asked once for each brick what to do with it; `visit(code, in, out)` gets the cells
/// of those to visit and the positions (in kWalkUnit) between which the ray is in them, and returns false to
/// stop. Returns false when stopped.
template <class Enter, class Visit>
inline __attribute__((always_inline)) bool walk_cells(const LatticeFrame& frame, const Ray& ray,
                                                      Stretch range, Enter&& enter, Visit&& visit) {
  using internal::WalkAxis;
  // A ray that would need more voxel lengths than this from plane to plane counts as running along them.
  constexpr double kAlong = 1 << 17;
  const double inverse_size = 1 / frame.voxel_size;
  const double norm = ray.direction.norm() * inverse_size;
  const double scale = norm / kWalkUnit;
  std::int64_t in = static_cast<std::int64_t>(range.begin * scale);
  const std::int64_t end = static_cast<std::int64_t>(range.end * scale);
  WalkAxis axes[3];
  int cell[3], brick[3];
  for (int a = 0; a < 3; ++a) {
    const double origin = (ray.origin[a] - frame.origin[a]) * inverse_size;
    const double direction = ray.direction[a] * inverse_size;
    const bool along = std::abs(direction) * kAlong < norm;
    const double per_cell = along ? 0 : scale / direction;
    axes[a].distance = static_cast<std::int64_t>(per_cell);
    axes[a].first = static_cast<std::int64_t>(-origin * per_cell);
    axes[a].step = along ? 0 : direction > 0 ? 1 : -1;
    axes[a].bricks = frame.size_in_bricks[a];
    const int guess = static_cast<int>(origin + range.begin * direction);
    cell[a] = std::clamp(axes[a].correct(guess, in), 0, axes[a].bricks * kBrickSide - 1);
    brick[a] = cell[a] >> 3;
  }
  const std::int64_t delta_x = std::abs(axes[0].distance), delta_y = std::abs(axes[1].distance),
                     delta_z = std::abs(axes[2].distance);
  const CellCode step_x = static_cast<CellCode>(std::int64_t{axes[0].step}),
                 step_y = static_cast<CellCode>(std::int64_t{axes[1].step} * (1 << internal::kCellBits)),
                 step_z = static_cast<CellCode>(axes[2].step * (std::int64_t{1} << 2 * internal::kCellBits));

  AtBrick what = enter(brick[0], brick[1], brick[2]);
  while (true) {
    if (what == AtBrick::kStop) return false;
    if (what == AtBrick::kSkip) {
      std::int64_t brick_out = axes[0].leaves(brick[0] * kBrickSide, kBrickSide);
      int out_axis = 0;
      for (int a = 1; a < 3; ++a) {
        const std::int64_t out = axes[a].leaves(brick[a] * kBrickSide, kBrickSide);
        if (out < brick_out) brick_out = out, out_axis = a;
      }
      if (brick_out >= end) return true;
      in = std::max(brick_out, in);
      brick[out_axis] += axes[out_axis].step;
      if (static_cast<unsigned>(brick[out_axis]) >= static_cast<unsigned>(axes[out_axis].bricks)) return true;
      what = enter(brick[0], brick[1], brick[2]);
      if (what != AtBrick::kVisit) continue;
      const double t = static_cast<double>(in) / scale;
      for (int a = 0; a < 3; ++a) {
        const int guess =
            static_cast<int>((ray.origin[a] + t * ray.direction[a] - frame.origin[a]) * inverse_size);
        const int low = brick[a] * kBrickSide;
        cell[a] = std::clamp(axes[a].correct(guess, in), low, low + kBrickSide - 1);
      }
    }
    std::int64_t next_x = axes[0].leaves(cell[0], 1), next_y = axes[1].leaves(cell[1], 1),
                 next_z = axes[2].leaves(cell[2], 1);
    CellCode code = cell_code(cell[0], cell[1], cell[2]);
    // Cell by cell, on through neighbouring bricks as long as they are visited.
    while (true) {
      const std::int64_t first = next_x < next_y ? next_x : next_y;
      const std::int64_t out = first < next_z ? first : next_z;
      if (out >= end) return end <= in || visit(code, in, end);
      if (out > in) {
        if (!visit(code, in, out)) return false;
        in = out;
      }
      // Branch-free: every axis whose plane is reached steps.
      const std::int64_t x = -static_cast<std::int64_t>(next_x == out);
      const std::int64_t y = -static_cast<std::int64_t>(next_y == out);
      const std::int64_t z = -static_cast<std::int64_t>(next_z == out);
      next_x += x & delta_x;
      next_y += y & delta_y;
      next_z += z & delta_z;
      const CellCode before = code;
      code += (static_cast<CellCode>(x) & step_x) + (static_cast<CellCode>(y) & step_y) +
              (static_cast<CellCode>(z) & step_z);
      if (((code ^ before) & ~internal::kCellInBrick) == 0) continue;
      bool outside = false;
      for (int a = 0; a < 3; ++a) {
        cell[a] = cell_index(code, a);
        brick[a] = cell[a] >> 3;
        outside |= static_cast<unsigned>(brick[a]) >= static_cast<unsigned>(axes[a].bricks);
      }
      if (outside) return true;
      what = enter(brick[0], brick[1], brick[2]);
      if (what != AtBrick::kVisit) break;
    }
  }
}

/// Calls segment(lattice, Stretch) for the stretches of the ray in each lattice, in ray order: outermost
/// first, inwards to lattice 0, and out again; stops when it returns false. `sight`, unless null, says for
/// each lattice between which depths there is anything (BrickSight).
template <class OnSegment>
void walk_lattices(const std::vector<Eigen::AlignedBox3d>& boxes, const Ray& ray, Stretch range,
                   const Stretch* sight, OnSegment&& on_segment) {
  const int count = static_cast<int>(boxes.size());
  const auto empty = [](const Stretch& r) { return r.end <= r.begin; };
  const auto segment = [&](int lattice, Stretch stretch) {
    if (sight) {
      stretch = {std::max(stretch.begin, sight[lattice].begin), std::min(stretch.end, sight[lattice].end)};
      if (empty(stretch)) return true;
    }
    return on_segment(lattice, stretch);
  };
  if (count == 1) {
    if (sight && empty(sight[0])) return;
    if (const Stretch only = clip_to_box(ray, boxes[0], range); !empty(only)) segment(0, only);
    return;
  }
  constexpr int kMaxLattices = 32;
  std::array<Stretch, kMaxLattices + 1> inside;
  for (int k = 0; k < count; ++k) inside[k + 1] = clip_to_box(ray, boxes[k], range);
  inside[0] = {1, 0};
  for (int k = count - 1; k >= 0; --k) {  // inwards
    const Stretch& outer = inside[k + 1];
    const Stretch& inner = inside[k];
    if (empty(outer)) continue;
    const Stretch front{outer.begin, empty(inner) ? outer.end : inner.begin};
    if (!empty(front) && !segment(k, front)) return;
  }
  for (int k = 1; k < count; ++k) {  // outwards
    const Stretch& outer = inside[k + 1];
    const Stretch& inner = inside[k];
    if (empty(outer) || empty(inner)) continue;
    const Stretch back{inner.end, outer.end};
    if (!empty(back) && !segment(k, back)) return;
  }
}

/// A run of steps along one ray within one lattice, as arrays: what the inner loops gather and vectorise
/// over.
struct alignas(64) StepChunk {
  static constexpr int kSize = 64;
  /// Arrays are worked on so many entries at a time: up to the next multiple of this behind the count, slots
  /// are good ones and the rest is rubbish.
  static constexpr int kLanes = roxel::kLanes;
  /// Steps that make a chunk worth handing over at a brick's border: rays then stop soon behind a surface.
  static constexpr int kEnough = 8;

  int count = 0;
  int lattice = 0;
  std::uint32_t slot[kSize];
  float length[kSize];         ///< chord, in voxel lengths of the lattice
  float weight[kSize];         ///< ray weight
  std::int32_t units[kSize];   ///< chord, in kWalkUnit; at most sqrt(3) of 2^28
  CellCode cell[kSize];        ///< the voxel in the lattice's frame
  std::int64_t middle[kSize];  ///< twice the position of the chord's middle, in kWalkUnit
  int brick_count = 0;         ///< bricks that begin in this chunk; its first steps may be of one before
  std::uint8_t brick_begin[kSize + 1];  ///< the first step of each: where segments break (docs/rays.md)
  float depth_per_length;               ///< extent in depth of a chord of one voxel length

  /// Depth of the chord's middle.
  float depth(int i) const {
    return static_cast<float>(static_cast<double>(middle[i]) * (0.5 * kWalkUnit * depth_per_length_));
  }
  Eigen::Vector3i voxel(int i) const {
    return {cell_index(cell[i], 0), cell_index(cell[i], 1), cell_index(cell[i], 2)};
  }

 private:
  friend class LatticeStack;
  /// Adds the voxels before its own in its word to `slot`, and fills `length`, and `weight`: 1 - d /
  /// (sqrt(3)/2), d the distance of the ray's line from the voxel's centre: 1 through the centre, 0 through a
  /// vertex. [Jethwa04] section 5.1.1. `direction` is the ray's unit direction, `near` a point of it near the
  /// chunk, in voxels of the frame.
  void complete(const float direction[3], const double near[3]);
  double depth_per_length_;
  std::uint32_t below_[kSize];  ///< bits of the voxels before a step's in its word of Brick
};

/// What a walk needs of a volume, gathered once.
class LatticeStack {
 public:
  explicit LatticeStack(const Volume& volume) : volume_(&volume) {
    std::uint32_t offset = 0;
    for (int k = 0; k < volume.lattice_count(); ++k) {
      boxes_.push_back(volume.index(k).frame().box());
      first_brick_.push_back(offset);
      offset += static_cast<std::uint32_t>(volume.index(k).bricks().size());
    }
    brick_count_ = offset;
  }
  const Volume& volume() const { return *volume_; }
  const std::vector<Eigen::AlignedBox3d>& boxes() const { return boxes_; }
  /// Bricks of all lattices are numbered in one range.
  std::uint32_t first_brick(int lattice) const { return first_brick_[lattice]; }
  std::uint32_t brick_count() const { return brick_count_; }
  int lattice_of(std::uint32_t number) const {
    int lattice = static_cast<int>(boxes_.size()) - 1;
    while (number < first_brick_[lattice]) --lattice;
    return lattice;
  }
  const Brick& brick(std::uint32_t number) const {
    const int lattice = lattice_of(number);
    return volume_->index(lattice).bricks()[number - first_brick_[lattice]];
  }

  /// Yields the existing voxels within `range` in chunks. `on_brick(number)` is called before the first voxel
  /// of each existing brick; `on_chunk(chunk)` gets at most `chunk_size` steps and returns false to stop.
  /// `sight`: see walk_lattices.
  template <class OnBrick, class OnChunk>
  void walk_chunks(const Ray& ray, Stretch range, const Stretch* sight, StepChunk& chunk, OnBrick&& on_brick,
                   OnChunk&& on_chunk, int chunk_size = StepChunk::kSize) const {
    const double norm = ray.direction.norm();
    const double inverse_norm = 1 / norm;
    const float unit[3] = {static_cast<float>(ray.direction.x() * inverse_norm),
                           static_cast<float>(ray.direction.y() * inverse_norm),
                           static_cast<float>(ray.direction.z() * inverse_norm)};
    walk_lattices(boxes_, ray, range, sight, [&](int lattice, Stretch stretch) {
      const BrickIndex& index = volume_->index(lattice);
      const LatticeFrame& frame = index.frame();
      const std::int32_t* table = index.table();
      const Brick* bricks = index.bricks().data();
      const int nx = frame.size_in_bricks.x(), ny = frame.size_in_bricks.y();
      // A point of the ray near the stretch: relative to it floats do.
      const double middle = 0.5 * (stretch.begin + stretch.end);
      const double near[3] = {
          (ray.origin.x() + middle * ray.direction.x() - frame.origin.x()) / frame.voxel_size,
          (ray.origin.y() + middle * ray.direction.y() - frame.origin.y()) / frame.voxel_size,
          (ray.origin.z() + middle * ray.direction.z() - frame.origin.z()) / frame.voxel_size};
      const Brick* brick = nullptr;
      chunk.lattice = lattice;
      chunk.depth_per_length_ = frame.voxel_size * inverse_norm;
      chunk.depth_per_length = static_cast<float>(chunk.depth_per_length_);
      // Steps in the chunk, the last brick that began there and where. All that the inner loop changes is
      // kept out of reach of what is called, so that it stays in registers.
      std::ptrdiff_t n = 0, last_brick = -1, last_begin = -1;
      const auto hand_over =
          [&unit, &near, &chunk, &on_chunk ](int count, int brick_count) __attribute__((noinline)) {
        chunk.count = count;
        chunk.brick_count = brick_count;
        chunk.complete(unit, near);
        for (int pad = count; pad % StepChunk::kLanes != 0; ++pad) chunk.slot[pad] = chunk.slot[0];
        return on_chunk(static_cast<const StepChunk&>(chunk));
      };
      const auto flush = [&]() __attribute__((always_inline)) {
        const std::ptrdiff_t count = std::exchange(n, 0);
        const int open = std::exchange(last_begin, -1) < count;
        return hand_over(static_cast<int>(count), static_cast<int>(std::exchange(last_brick, -1)) + open);
      };
      const std::ptrdiff_t full = chunk_size;
      const auto enter = [&](int bx, int by, int bz) __attribute__((always_inline)) {
        const std::int32_t found =
            table[bx + static_cast<std::size_t>(nx) * (by + static_cast<std::size_t>(ny) * bz)];
        if (found < 0) return AtBrick::kSkip;
        if (n >= StepChunk::kEnough && !flush()) return AtBrick::kStop;
        brick = &bricks[found];
        last_brick += last_begin != n;
        last_begin = n;
        chunk.brick_begin[last_brick] = static_cast<std::uint8_t>(n);
        on_brick(first_brick_[lattice] + static_cast<std::uint32_t>(found));
        return AtBrick::kVisit;
      };
      const auto visit = [&](CellCode code, std::int64_t in, std::int64_t out)
          __attribute__((always_inline)) {
        // Written whether there is a voxel or not, counted if there is: cheaper than a branch that is
        // mispredicted at every surface.
        const int voxel = cell_in_brick(code);
        const std::uint32_t word = brick->word[voxel / 32], bit = std::uint32_t{1} << voxel % 32;
        const std::ptrdiff_t exists = (word & bit) != 0;
        chunk.slot[n] = brick->first_slot + brick->before[voxel / 32];
        chunk.below_[n] = word & (bit - 1);
        chunk.units[n] = static_cast<std::int32_t>(out - in);
        chunk.middle[n] = in + out;
        chunk.cell[n] = code;
        n += exists;
        return n < full || flush();
      };
      if (!walk_cells(frame, ray, stretch, enter, visit)) return false;
      return n == 0 || flush();
    });
  }

  /// The same one step at a time: `visit(VoxelStep, VoxelPlace)`. For those who need no speed.
  template <class OnBrick, class Visit>
  void walk(const Ray& ray, Stretch range, OnBrick&& on_brick, Visit&& visit) const {
    StepChunk chunk;
    walk_chunks(ray, range, nullptr, chunk, on_brick, [&](const StepChunk& steps) {
      for (int n = 0; n < steps.count; ++n) {
        const VoxelStep step{steps.slot[n], steps.length[n], steps.weight[n], steps.depth(n)};
        const VoxelPlace place{steps.lattice, steps.voxel(n)};
        if (!visit(step, place)) return false;
      }
      return true;
    });
  }

 private:
  const Volume* volume_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<std::uint32_t> first_brick_;
  std::uint32_t brick_count_ = 0;
};

}  // namespace roxel

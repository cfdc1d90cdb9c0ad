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

/// Where a step's voxel is: a lattice, one of its bricks, and the voxel within the brick.
struct VoxelPlace {
  int lattice;
  const Brick* brick;
  int i, j, k;

  Eigen::Vector3d centre(const LatticeFrame& frame) const {
    return frame.voxel_centre(kBrickSide * brick->coord + Eigen::Vector3i(i, j, k));
  }
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

namespace internal {

/// A cell of a brick packed into nibbles i, j, k; one step out of [0, 8) on any axis sets a guard bit.
inline constexpr int kPackedOutside = 0x888;
inline int pack_cell(int i, int j, int k) { return i | j << 4 | k << 8; }
inline int packed_i(int p) { return p & 7; }
inline int packed_j(int p) { return p >> 4 & 7; }
inline int packed_k(int p) { return p >> 8 & 7; }
inline int packed_voxel(int p) { return (p & 7) | (p >> 1 & 0x38) | (p >> 2 & 0x1c0); }

}  // namespace internal

/// Positions along a ray inside walk_cells are integers: 2^-24 voxel lengths from the ray's origin. Integer
/// compares and adds make the walk's chain of dependent steps short, and do not depend on where a walk
/// begins.
inline constexpr double kWalkUnit = 1.0 / (1 << 24);

/// Amanatides-Woo over the cells of one frame within `range`, which must lie inside the frame's box.
/// `enter(bx, by, bz)` is asked once for each brick and says whether to visit its cells; `wanted(voxel)` says
/// which cells of it, by voxel_in_brick; `visit(packed cell, in, out)` gets those with their positions (in
/// kWalkUnit) and returns false to stop. Returns false when stopped.
template <class Enter, class Wanted, class Visit>
inline __attribute__((always_inline)) bool walk_cells(const LatticeFrame& frame, const Ray& ray,
                                                      Stretch range, Enter&& enter, Wanted&& wanted,
                                                      Visit&& visit) {
  const double inverse_size = 1 / frame.voxel_size;
  const double infinity = std::numeric_limits<double>::infinity();
  double origin[3], direction[3], inverse[3], delta[3];
  int step[3], cell[3], cells[3];
  for (int a = 0; a < 3; ++a) {
    origin[a] = (ray.origin[a] - frame.origin[a]) * inverse_size;
    direction[a] = ray.direction[a] * inverse_size;
    step[a] = direction[a] > 0 ? 1 : -1;
    inverse[a] = direction[a] != 0 ? 1 / direction[a] : infinity;
    delta[a] = std::abs(inverse[a]);
    cells[a] = frame.size_in_bricks[a] * kBrickSide;
  }
  const auto cell_at = [&](double t, int a) {
    return std::clamp(static_cast<int>(origin[a] + t * direction[a]), 0, cells[a] - 1);
  };
  const double fixed_scale = ray.direction.norm() * inverse_size / kWalkUnit;
  constexpr double kFarthest = 1e18;
  constexpr std::int64_t kNever = static_cast<std::int64_t>(kFarthest);
  const auto fixed = [&](double at) {
    return static_cast<std::int64_t>(std::min(at * fixed_scale, kFarthest));
  };
  const std::int64_t delta_x = fixed(delta[0]), delta_y = fixed(delta[1]), delta_z = fixed(delta[2]);
  const std::int64_t step_x = step[0], step_y = step[1] * 16, step_z = step[2] * 256;
  double t = range.begin;
  for (int a = 0; a < 3; ++a) cell[a] = cell_at(t, a);
  while (t < range.end) {
    const int brick[3] = {cell[0] >> 3, cell[1] >> 3, cell[2] >> 3};
    // Where does the ray leave this brick, and over which axis?
    double brick_out = infinity;
    int out_axis = 0;
    for (int a = 0; a < 3; ++a) {
      if (direction[a] == 0) continue;
      const double plane = (brick[a] + (step[a] > 0)) * kBrickSide;
      const double t_plane = (plane - origin[a]) * inverse[a];
      if (t_plane < brick_out) brick_out = t_plane, out_axis = a;
    }
    const double brick_end = std::min(std::max(brick_out, t), range.end);
    if (brick_end > t && enter(brick[0], brick[1], brick[2])) {
      const auto next_plane = [&](int a) {
        return direction[a] != 0 ? fixed((cell[a] + (step[a] > 0) - origin[a]) * inverse[a]) : kNever;
      };
      std::int64_t next_x = next_plane(0), next_y = next_plane(1), next_z = next_plane(2);
      const std::int64_t end = fixed(brick_end);
      std::int64_t in = fixed(t);
      int packed = internal::pack_cell(cell[0] & 7, cell[1] & 7, cell[2] & 7);
      while (true) {
        const std::int64_t first = next_x < next_y ? next_x : next_y;
        const std::int64_t out = first < next_z ? first : next_z;
        if (wanted(internal::packed_voxel(packed))) {
          const std::int64_t chord_end = out < end ? out : end;
          if (chord_end > in && !visit(packed, in, chord_end)) return false;
        }
        // Branch-free: every axis whose plane is reached steps.
        const std::int64_t x = -static_cast<std::int64_t>(next_x == out);
        const std::int64_t y = -static_cast<std::int64_t>(next_y == out);
        const std::int64_t z = -static_cast<std::int64_t>(next_z == out);
        next_x += x & delta_x;
        next_y += y & delta_y;
        next_z += z & delta_z;
        packed += static_cast<int>((x & step_x) + (y & step_y) + (z & step_z));
        if (out >= end || (packed & internal::kPackedOutside)) break;
        in = in > out ? in : out;
      }
    }
    // Step over the brick's face; the other coordinates are recomputed so that errors do not add up.
    t = brick_end;
    if (brick_out >= range.end) return true;
    for (int a = 0; a < 3; ++a) {
      if (a == out_axis) {
        const int next_brick = brick[a] + step[a];
        if (next_brick < 0 || next_brick >= frame.size_in_bricks[a]) return true;
        cell[a] = next_brick * kBrickSide + (step[a] > 0 ? 0 : kBrickSide - 1);
      } else {
        cell[a] = std::clamp(cell_at(t, a), brick[a] * kBrickSide, brick[a] * kBrickSide + kBrickSide - 1);
      }
    }
  }
  return true;
}

/// Calls segment(lattice, Stretch) for the stretches of the ray in each lattice, in ray order: outermost
/// first, inwards to lattice 0, and out again; stops when it returns false.
template <class OnSegment>
void walk_lattices(const std::vector<Eigen::AlignedBox3d>& boxes, const Ray& ray, Stretch range,
                   OnSegment&& segment) {
  const int count = static_cast<int>(boxes.size());
  const auto empty = [](const Stretch& r) { return r.end <= r.begin; };
  if (count == 1) {
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

  int count = 0;
  int lattice = 0;
  std::uint32_t slot[kSize];
  float length[kSize];      ///< chord, in voxel lengths of the lattice
  float depth[kSize];       ///< of the chord's middle
  float weight[kSize];      ///< ray weight
  bool brick_start[kSize];  ///< first step in its brick: where segments break (docs/rays.md)
  const Brick* brick[kSize];
  int packed[kSize];       ///< the voxel in its brick, see internal::pack_cell
  float depth_per_length;  ///< extent in depth of a chord of one voxel length

  Eigen::Vector3d voxel_centre(const LatticeFrame& frame, int i) const {
    return frame.voxel_centre(kBrickSide * brick[i]->coord + Eigen::Vector3i(internal::packed_i(packed[i]),
                                                                             internal::packed_j(packed[i]),
                                                                             internal::packed_k(packed[i])));
  }

  // From a point of the ray to the voxel's centre, in voxel lengths; set_weights turns it into weights.
  float from_ray[3][kSize];
  /// weight = 1 - d / (sqrt(3)/2), d the distance of the ray's line from the voxel's centre: 1 through the
  /// centre, 0 through a vertex. [Jethwa04] section 5.1.1. `u` is the ray's unit direction.
  void set_weights(const float u[3]) {
    constexpr float kInverseVertexDistance = 1.1547005383792515f;
    const float ux = u[0], uy = u[1], uz = u[2];
    for (int i = 0; i < count; ++i) {
      const float x = from_ray[0][i], y = from_ray[1][i], z = from_ray[2][i];
      // A cross product: |p|^2 - (p u)^2 would lose the digits of d far from the stretch's middle.
      const float cx = y * uz - z * uy, cy = z * ux - x * uz, cz = x * uy - y * ux;
      const float d = std::sqrt(cx * cx + cy * cy + cz * cz) * kInverseVertexDistance;
      weight[i] = d < 1 ? 1 - d : 0.0f;
    }
  }
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
  const Brick& brick(std::uint32_t number) const {
    int lattice = static_cast<int>(boxes_.size()) - 1;
    while (number < first_brick_[lattice]) --lattice;
    return volume_->index(lattice).bricks()[number - first_brick_[lattice]];
  }

  /// Yields the existing voxels within `range` in chunks. `on_brick(number)` is called before the first voxel
  /// of each existing brick; `on_chunk(chunk)` gets at most `chunk_size` steps and returns false to stop.
  template <class OnBrick, class OnChunk>
  void walk_chunks(const Ray& ray, Stretch range, StepChunk& chunk, OnBrick&& on_brick, OnChunk&& on_chunk,
                   int chunk_size = StepChunk::kSize) const {
    const double norm = ray.direction.norm();
    const Eigen::Vector3d unit = ray.direction / norm;
    const float unit_f[3] = {static_cast<float>(unit.x()), static_cast<float>(unit.y()),
                             static_cast<float>(unit.z())};
    const auto hand_over = [&](int count) __attribute__((noinline)) {
      chunk.count = count;
      chunk.set_weights(unit_f);
      return on_chunk(static_cast<const StepChunk&>(chunk));
    };
    walk_lattices(boxes_, ray, range, [&](int lattice, Stretch stretch) {
      const BrickIndex& index = volume_->index(lattice);
      const LatticeFrame& frame = index.frame();
      const std::int32_t* table = index.table();
      const Brick* bricks = index.bricks().data();
      const int nx = frame.size_in_bricks.x(), ny = frame.size_in_bricks.y();
      const double length_scale = norm / frame.voxel_size;
      // A point of the ray near the stretch: relative to it floats do.
      const double middle = 0.5 * (stretch.begin + stretch.end);
      const Eigen::Vector3d near = (ray.origin + middle * ray.direction - frame.origin) / frame.voxel_size;
      const Brick* brick = nullptr;
      const std::uint16_t* local = nullptr;
      float brick_from_ray[3] = {0, 0, 0};
      bool starts_brick = false;
      chunk.lattice = lattice;
      chunk.depth_per_length = static_cast<float>(1 / length_scale);
      const auto enter = [&](int bx, int by, int bz) {
        const std::int32_t found =
            table[bx + static_cast<std::size_t>(nx) * (by + static_cast<std::size_t>(ny) * bz)];
        if (found < 0) return false;
        brick = bricks + found;
        local = brick->local.data();
        brick_from_ray[0] = static_cast<float>(bx * kBrickSide + 0.5 - near.x());
        brick_from_ray[1] = static_cast<float>(by * kBrickSide + 0.5 - near.y());
        brick_from_ray[2] = static_cast<float>(bz * kBrickSide + 0.5 - near.z());
        starts_brick = true;
        on_brick(first_brick_[lattice] + static_cast<std::uint32_t>(found));
        return true;
      };
      const auto wanted = [&](int voxel) __attribute__((always_inline)) { return local[voxel] != kNoVoxel; };
      const double depth_scale = 0.5 * kWalkUnit / length_scale;
      int n = 0;
      const auto visit = [&](int packed, std::int64_t in, std::int64_t out) __attribute__((always_inline)) {
        chunk.slot[n] = brick->first_slot + local[internal::packed_voxel(packed)];
        chunk.length[n] = static_cast<float>(static_cast<double>(out - in) * kWalkUnit);
        chunk.depth[n] = static_cast<float>(static_cast<double>(in + out) * depth_scale);
        chunk.from_ray[0][n] = brick_from_ray[0] + static_cast<float>(internal::packed_i(packed));
        chunk.from_ray[1][n] = brick_from_ray[1] + static_cast<float>(internal::packed_j(packed));
        chunk.from_ray[2][n] = brick_from_ray[2] + static_cast<float>(internal::packed_k(packed));
        chunk.brick_start[n] = starts_brick;
        chunk.brick[n] = brick;
        chunk.packed[n] = packed;
        starts_brick = false;
        if (++n < chunk_size) return true;
        n = 0;
        return hand_over(chunk_size);
      };
      if (!walk_cells(frame, ray, stretch, enter, wanted, visit)) return false;
      return n == 0 || hand_over(n);
    });
  }

  /// The same one step at a time: `visit(VoxelStep, VoxelPlace)`. For those who need no speed.
  template <class OnBrick, class Visit>
  void walk(const Ray& ray, Stretch range, OnBrick&& on_brick, Visit&& visit) const {
    StepChunk chunk;
    walk_chunks(ray, range, chunk, on_brick, [&](const StepChunk& steps) {
      for (int n = 0; n < steps.count; ++n) {
        const VoxelStep step{steps.slot[n], steps.length[n], steps.weight[n], steps.depth[n]};
        const int p = steps.packed[n];
        const VoxelPlace place{steps.lattice, steps.brick[n], internal::packed_i(p), internal::packed_j(p),
                               internal::packed_k(p)};
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

#pragma once
/// Traversal of the nested lattices along one ray. The walk yields the existing voxels in ray order and skips
/// empty bricks; what happens in a voxel is the visitor's business, which may also say stop.
///
/// Depths are in units of the ray's direction: distance along the optical axis for rays of PinholeCamera::ray.

#include <algorithm>
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
  float weight;  ///< ray weight: 1 through the voxel's centre, 0 at distance sqrt(3)/2 (a vertex), linear between
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
  double begin = 0;
  double end = 0;
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

/// Amanatides-Woo over the cells of one frame within `range`, which must lie inside the frame's box.
/// `enter(bx, by, bz)` is asked once for each brick and says whether to visit its cells; `wanted(voxel)` says
/// which cells of it, by voxel_in_brick; `visit(packed cell, in, out)` gets those with their depths and returns
/// false to stop. Returns false when stopped. All decisions depend on the ray and the frame alone.
template <class Enter, class Wanted, class Visit>
bool walk_cells(const LatticeFrame& frame, const Ray& ray, Stretch range, Enter&& enter, Wanted&& wanted,
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
    return std::clamp(static_cast<int>(std::floor(origin[a] + t * direction[a])), 0, cells[a] - 1);
  };
  const int step_x = step[0], step_y = step[1] * 16, step_z = step[2] * 256;
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
        return direction[a] != 0 ? (cell[a] + (step[a] > 0) - origin[a]) * inverse[a] : infinity;
      };
      double next_x = next_plane(0), next_y = next_plane(1), next_z = next_plane(2);
      const double delta_x = delta[0], delta_y = delta[1], delta_z = delta[2];
      int packed = internal::pack_cell(cell[0] & 7, cell[1] & 7, cell[2] & 7);
      double in = t;
      while (true) {
        double out;
        int next_packed;
        if (next_x < next_y && next_x < next_z) {
          out = next_x, next_packed = packed + step_x, next_x += delta_x;
        } else if (next_y < next_z) {
          out = next_y, next_packed = packed + step_y, next_y += delta_y;
        } else {
          out = next_z, next_packed = packed + step_z, next_z += delta_z;
        }
        if (wanted(internal::packed_voxel(packed))) {
          const double end = std::min(out, brick_end);
          if (end > in && !visit(packed, in, end)) return false;
        }
        if (out >= brick_end || (next_packed & internal::kPackedOutside)) break;
        in = std::max(in, out);
        packed = next_packed;
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
  constexpr int kMaxLattices = 64;
  Stretch inside[kMaxLattices + 1];
  for (int k = 0; k < count; ++k) inside[k + 1] = clip_to_box(ray, boxes[k], range);
  inside[0] = {1, 0};
  const auto empty = [](const Stretch& r) { return r.end <= r.begin; };
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

/// Ray weight of a chord in cell (i, j, k): 1 - d / (sqrt(3)/2), d the distance of the ray's line from the cell's
/// centre in voxel lengths. [Jethwa04] section 5.1.1.
inline float ray_weight(const float origin[3], const float unit_direction[3], int i, int j, int k) {
  const float x = i + 0.5f - origin[0], y = j + 0.5f - origin[1], z = k + 0.5f - origin[2];
  const float along = x * unit_direction[0] + y * unit_direction[1] + z * unit_direction[2];
  const float squared = x * x + y * y + z * z - along * along;
  constexpr float kInverseVertexDistance = 1.1547005383792515f;
  return std::max(0.0f, 1 - std::sqrt(std::max(0.0f, squared)) * kInverseVertexDistance);
}

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

  /// Yields the existing voxels within `range`. `on_brick(number)` is called before the first voxel of each
  /// existing brick; `visit(VoxelStep, VoxelPlace)` returns false to stop.
  template <class OnBrick, class Visit>
  void walk(const Ray& ray, Stretch range, OnBrick&& on_brick, Visit&& visit) const {
    walk_lattices(boxes_, ray, range, [&](int lattice, Stretch stretch) {
      const BrickIndex& index = volume_->index(lattice);
      const LatticeFrame& frame = index.frame();
      const std::int32_t* table = index.table();
      const Brick* bricks = index.bricks().data();
      const int nx = frame.size_in_bricks.x(), ny = frame.size_in_bricks.y();
      const double norm = ray.direction.norm();
      const double length_scale = norm / frame.voxel_size;
      const Eigen::Vector3d local = (ray.origin - frame.origin) / frame.voxel_size;
      const Eigen::Vector3d unit = ray.direction / norm;
      const float unit_f[3] = {static_cast<float>(unit.x()), static_cast<float>(unit.y()), static_cast<float>(unit.z())};
      const Brick* brick = nullptr;
      // A point of the ray near the brick, relative to it: small numbers, so floats do.
      float near_origin[3];
      const auto enter = [&](int bx, int by, int bz) {
        const std::int32_t found = table[bx + static_cast<std::size_t>(nx) * (by + static_cast<std::size_t>(ny) * bz)];
        if (found < 0) return false;
        brick = bricks + found;
        const Eigen::Vector3d relative = local - kBrickSide * Eigen::Vector3d(bx, by, bz);
        const double along = (Eigen::Vector3d::Constant(kBrickSide / 2) - relative).dot(unit);
        for (int a = 0; a < 3; ++a) near_origin[a] = static_cast<float>(relative[a] + along * unit[a]);
        on_brick(first_brick_[lattice] + static_cast<std::uint32_t>(found));
        return true;
      };
      const auto wanted = [&](int voxel) { return brick->local[voxel] != kNoVoxel; };
      return walk_cells(frame, ray, stretch, enter, wanted, [&](int packed, double in, double out) {
        const int i = internal::packed_i(packed), j = internal::packed_j(packed), k = internal::packed_k(packed);
        const VoxelStep step{brick->first_slot + brick->local[internal::packed_voxel(packed)],
                             static_cast<float>((out - in) * length_scale), ray_weight(near_origin, unit_f, i, j, k),
                             static_cast<float>(0.5 * (in + out))};
        return visit(step, VoxelPlace{lattice, brick, i, j, k});
      });
    });
  }

 private:
  const Volume* volume_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<std::uint32_t> first_brick_;
  std::uint32_t brick_count_ = 0;
};

}  // namespace roxel

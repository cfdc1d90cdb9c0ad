#pragma once
/// The sparse voxel volume: which voxels exist (Topology, an OpenVDB tree inside), where they are in the
/// channel arrays (BrickIndex), and what they hold (channels: plain arrays, one slot a voxel).
///
/// The world is covered by nested lattices. Lattice 0 is the box that is reconstructed. Lattice k >= 1 is
/// surround: twice the extent of lattice k-1 about the same centre, voxels twice as large, and empty inside
/// lattice k-1's box.
///
///     +---------------------------+
///     |  lattice 2 (4 s)          |      slots:  [ lattice 0 | lattice 1 | lattice 2 | ... ]
///     |   +-------------------+   |      within a lattice: brick after brick (x fastest),
///     |   | lattice 1 (2 s)   |   |      within a brick: voxel after voxel (x fastest)
///     |   |   +-----------+   |   |
///     |   |   | lattice 0 |   |   |
///     |   |   +-----------+   |   |
///     |   +-------------------+   |
///     +---------------------------+

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <bitset>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "roxel/volume/packed_covariance.h"

namespace roxel {

inline constexpr int kBrickSide = 8;
inline constexpr int kBrickVoxels = kBrickSide * kBrickSide * kBrickSide;
/// The brick table of a lattice is dense, 4 bytes a brick: 1 GiB is where a voxel size is taken for a
/// mistake.
inline constexpr double kMaxBricks = 1 << 28;
inline constexpr std::uint32_t kNoSlot = 0xffffffffu;

/// Index of a voxel within its brick: x fastest; i, j, k in [0, 8).
inline int voxel_in_brick(int i, int j, int k) { return i + kBrickSide * (j + kBrickSide * k); }

/// A box of bricks in the world. Voxel (i, j, k) covers origin + voxel_size * [i, i+1) x [j, j+1) x [k, k+1).
struct LatticeFrame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double voxel_size = 1;
  Eigen::Vector3i size_in_bricks = Eigen::Vector3i::Zero();

  Eigen::Vector3i size_in_voxels() const { return kBrickSide * size_in_bricks; }
  Eigen::AlignedBox3d box() const;
  Eigen::Vector3d voxel_centre(const Eigen::Vector3i& ijk) const {
    return origin + voxel_size * (ijk.cast<double>() + Eigen::Vector3d::Constant(0.5));
  }
};

/// The voxels of one brick: bit voxel_in_brick(i, j, k).
using BrickMask = std::bitset<kBrickVoxels>;

/// Some of a brick's voxels.
struct BrickVoxels {
  Eigen::Vector3i brick;
  BrickMask mask;

  bool operator==(const BrickVoxels& other) const { return brick == other.brick && mask == other.mask; }
};

/// Which voxels of a lattice exist. Copyable value; edits keep to the frame's box. `threads` changes no
/// result.
class Topology {
 public:
  explicit Topology(const LatticeFrame& frame);
  Topology(const Topology&);
  Topology(Topology&&) noexcept;
  Topology& operator=(const Topology&);
  Topology& operator=(Topology&&) noexcept;
  ~Topology();

  const LatticeFrame& frame() const { return frame_; }
  std::int64_t voxel_count() const;
  bool contains(const Eigen::Vector3i& ijk) const;
  void insert(const Eigen::Vector3i& ijk);

  /// Adds the set bits of a brick's mask.
  void insert_brick(const Eigen::Vector3i& brick, const BrickMask& mask);
  /// The same for many bricks, each of them named at most once.
  void insert_bricks(std::span<const BrickVoxels> bricks, int threads = 1);
  /// Removes the set bits of a brick's mask.
  void erase_brick(const Eigen::Vector3i& brick, const BrickMask& mask);
  /// Adds all voxels within `voxels` steps over faces, edges and corners, clipped to the box.
  void dilate(int voxels, int threads = 1);
  /// Removes all voxels whose centre is inside `box` (world): keeps surround out of the lattice within.
  void erase_inside(const Eigen::AlignedBox3d& box, int threads = 1);
  /// The same voxels divided into eight: a lattice of half the voxel size and twice the bricks a side.
  Topology subdivided(int threads = 1) const;

  /// Every brick that has voxels, x fastest, then y, then z.
  std::vector<BrickVoxels> bricks(int threads = 1) const;
  /// Calls visit(brick, mask) for every brick that has voxels, x fastest, then y, then z.
  void for_each_brick(const std::function<void(const Eigen::Vector3i&, const BrickMask&)>& visit) const;

 private:
  struct Tree;
  LatticeFrame frame_;
  std::unique_ptr<Tree> tree_;
};

/// One brick of the compiled index: voxel v exists where bit v % 32 of word[v / 32] is set, and its slot is
/// first_slot plus before[v / 32] plus the bits set below it.
struct alignas(64) Brick {
  std::array<std::uint32_t, kBrickVoxels / 32> word;
  std::array<std::uint16_t, kBrickVoxels / 32> before;
  Eigen::Vector3i coord;  ///< in bricks
  std::uint32_t first_slot;

  bool has(int v) const { return (word[v / 32] >> v % 32 & 1) != 0; }
  /// The slot of a voxel that exists.
  std::uint32_t slot(int v) const {
    const std::uint32_t below = word[v / 32] & ((std::uint32_t{1} << v % 32) - 1);
    return first_slot + before[v / 32] + static_cast<std::uint32_t>(std::popcount(below));
  }
  /// Of voxels that exist.
  std::uint32_t count() const {
    return before.back() + static_cast<std::uint32_t>(std::popcount(word.back()));
  }
  /// Calls visit(v, slot) for each voxel that exists, x fastest.
  template <class Visit>
  void for_each_voxel(Visit&& visit) const {
    std::uint32_t slot = first_slot;
    for (int w = 0; w < static_cast<int>(word.size()); ++w)
      for (std::uint32_t left = word[w]; left != 0; left &= left - 1)
        visit(32 * w + std::countr_zero(left), slot++);
  }
};
static_assert(sizeof(Brick) == 128);

/// Index within the lattice of voxel v of a brick.
inline Eigen::Vector3i voxel_of(const Brick& brick, int v) {
  return kBrickSide * brick.coord +
         Eigen::Vector3i(v % kBrickSide, v / kBrickSide % kBrickSide, v / (kBrickSide * kBrickSide));
}

/// A topology compiled for the march: from a voxel to its slot.
class BrickIndex {
 public:
  BrickIndex() = default;
  /// Slots are handed out from first_slot on, brick by brick (x fastest), voxel by voxel (x fastest).
  BrickIndex(const Topology& topology, std::uint32_t first_slot, int threads = 1);

  const LatticeFrame& frame() const { return frame_; }
  std::uint32_t first_slot() const { return first_slot_; }
  std::uint32_t slot_count() const { return slot_count_; }
  const std::vector<Brick>& bricks() const { return bricks_; }
  /// Index into bricks(), or -1; (bx, by, bz) must be inside the frame.
  std::int32_t brick_at(int bx, int by, int bz) const {
    return table_[bx + static_cast<std::size_t>(frame_.size_in_bricks.x()) *
                           (by + static_cast<std::size_t>(frame_.size_in_bricks.y()) * bz)];
  }
  const std::int32_t* table() const { return table_.data(); }
  /// The slot of voxel ijk, or kNoSlot where there is none or ijk is outside the frame.
  std::uint32_t slot(const Eigen::Vector3i& ijk) const;

 private:
  LatticeFrame frame_;
  std::uint32_t first_slot_ = 0;
  std::uint32_t slot_count_ = 0;
  std::vector<std::int32_t> table_;
  std::vector<Brick> bricks_;
};

/// The frames of a volume: the box's lattice and `surround_count` lattices around it. The box is `bounds`
/// grown to whole bricks (multiples of 4 bricks a side when there is surround, so that lattices nest on brick
/// planes).
std::vector<LatticeFrame> nested_frames(const Eigen::AlignedBox3d& bounds, double voxel_size,
                                        int surround_count);

/// Topologies, their compiled indices and the channels that persist between passes. Slots of all lattices
/// share one range, [0, slot_count()).
class Volume {
 public:
  Volume() = default;
  explicit Volume(std::vector<Topology> lattices, int threads = 1);

  int lattice_count() const { return static_cast<int>(topologies_.size()); }
  const Topology& topology(int lattice) const { return topologies_[lattice]; }
  const BrickIndex& index(int lattice) const { return indices_[lattice]; }
  std::uint32_t slot_count() const { return slot_count_; }
  /// Slots of lattice 0, the reconstructed box: [0, box_slot_count()).
  std::uint32_t box_slot_count() const;

  // Channels, one entry a slot, all but the last sized slot_count():
  std::vector<float> tau;                        ///< optical depth over one voxel length, >= 0
  std::vector<float> confidence;                 ///< n / (n + 2), in [0, 1)
  std::vector<float> color_weight;               ///< summed weight of the colour, w
  std::vector<std::array<float, 3>> color_mean;  ///< in the matching colour space
  std::vector<PackedCovariance> color_cov;       ///< of the same
  std::vector<std::array<float, 2>>
      support;  ///< evidence of the last opacity pass: sum r, and exposure (denominator)

  /// Linear RGB >= 0, 1 = display white: what voxels are painted with, interpolated between their centres.
  /// Empty where that is color_mean, of each voxel for itself.
  std::vector<std::array<float, 3>> fitted_color;

  void resize_channels(int threads = 1);

 private:
  std::vector<Topology> topologies_;
  std::vector<BrickIndex> indices_;
  std::uint32_t slot_count_ = 0;
};

/// Opacity over one voxel length from optical depth, and back; alpha in [0, 1).
float alpha_from_tau(float tau);
float tau_from_alpha(float alpha);

}  // namespace roxel

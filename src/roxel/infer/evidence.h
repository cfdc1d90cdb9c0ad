#pragma once
/// Exact sums of what all nodes say about each voxel. A node's own sums are collected by one worker in a
/// fixed order (NodeScratch, floats); the totals over nodes are integers (fixed point), so that nodes may
/// arrive in any order, from any thread or rank, and the totals are the same bit for bit.
///
/// Bounds: a node adds at most weight 1 of colours with components below 2^10 (clamped) to a voxel, so colour
/// sums stay below nodes * 2^20 * 2^24 (second moments) and cannot overflow for fewer than 2^19 nodes.
/// Opacity sums are saturated at 2^20 a node and voxel (2^40 in fixed point).

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "roxel/march/ray_walk.h"

namespace roxel {

/// One worker's memory of one voxel while it works on one node: 64 bytes, one cache line.
/// Colour march: w, sums of w x and w x x'. Opacity march: mean and covariance of the others, their weight,
/// and the node's opacity sums.
struct alignas(64) VoxelScratch {
  float mean[3];
  float cov[6];
  float evidence;
  float tau;
  float unused;
  float hits;      ///< sum of r
  float exposure;  ///< posterior: sum of (R - r) l + r e; roxels: sum of r alpha
  float looked;    ///< largest reach x ray weight
  float unused_too;
};

/// Totals of one voxel's colour: 0 weight, 1-3 sum w x, 4-9 sum w x x' (order xx, yy, zz, xy, xz, yz).
using ColorTotals = std::array<std::int64_t, 10>;
/// Totals of one voxel's opacity evidence: hits, exposure, looked.
using OpacityTotals = std::array<std::int64_t, 3>;

/// Colour of a voxel as rays are compared with it.
struct VoxelColor {
  float mean[3] = {0, 0, 0};
  float cov[6] = {0, 0, 0, 0, 0, 0};
  float evidence = 0;
};

/// A node's own colour sums, kept between the two halves of a pass: the voxels that it coloured, brick by
/// brick.
struct OwnColors {
  struct BrickPart {
    std::uint32_t brick;
    std::uint32_t count;  ///< of entries
  };
  struct Entry {
    std::uint32_t slot;
    VoxelColor color;  ///< sums of w x and w x x', and w
    static Entry of(std::uint32_t slot, const VoxelScratch& voxel);
  };
  std::vector<BrickPart> bricks;
  std::vector<Entry> entries;

  void clear() { bricks.clear(), entries.clear(); }
  std::size_t bytes() const { return bricks.size() * sizeof(BrickPart) + entries.size() * sizeof(Entry); }
};

inline constexpr double kColorUnit = 1 << 24;
inline constexpr double kOpacityUnit = 1 << 20;

/// A worker's scratch for all slots; bricks are set up when a node's ray first enters them.
class NodeScratch {
 public:
  NodeScratch(const LatticeStack& stack, const std::vector<float>& tau);

  VoxelScratch& operator[](std::uint32_t slot) { return voxels_[slot]; }
  const VoxelScratch& operator[](std::uint32_t slot) const { return voxels_[slot]; }
  const VoxelScratch* voxels() const { return voxels_.get(); }
  VoxelScratch* voxels() { return voxels_.get(); }
  /// Sets up the brick's voxels if this node has not been here before: their tau, no sums, and the totals'
  /// colours after compare_with.
  void enter(std::uint32_t brick) {
    if (!entered_[brick]) set_up_brick(brick);
  }
  /// Turns all entered voxels from the node's own colour sums into what the *other* nodes say (the totals
  /// less the node's own, capped); bricks entered from now on get the totals, and opacity sums start at 0.
  void compare_with(const std::vector<ColorTotals>& totals);
  /// The same for a scratch that has been reset, with the node's own colour sums from Totals::add_color.
  void compare_with(const std::vector<ColorTotals>& totals, const OwnColors& own);
  const std::vector<std::uint32_t>& entered_bricks() const { return order_; }
  /// Forgets the node.
  void reset();
  /// The same, and goes over to another pass over a volume of the same voxels.
  void reset(const LatticeStack& stack, const std::vector<float>& tau);

 private:
  void set_up_brick(std::uint32_t brick);
  const Brick& note(std::uint32_t brick);

  const LatticeStack* stack_;
  const float* tau_;
  const ColorTotals* totals_ = nullptr;
  std::unique_ptr<VoxelScratch[]> voxels_;
  std::vector<std::uint8_t> entered_;
  std::vector<std::uint32_t> order_;
};

/// The node's colour sums of one voxel in fixed point, its weight capped at 1 (docs/passes.md, predictive
/// agreement).
ColorTotals capped_color(const VoxelScratch& voxel);

/// Adds a node's sums to the totals; safe from several threads at once.
class Totals {
 public:
  explicit Totals(std::uint32_t slot_count);
  void clear_color();
  void clear_opacity();
  /// `own`, unless null, gets the node's sums.
  void add_color(const LatticeStack& stack, const NodeScratch& node, OwnColors* own = nullptr);
  void add_opacity(const LatticeStack& stack, const NodeScratch& node);

  std::vector<ColorTotals> color;
  std::vector<OpacityTotals> opacity;

 private:
  class BrickLock;
  static constexpr int kLocks = 1024;
  std::array<std::atomic_flag, kLocks> locks_{};
};

/// Mean, covariance and weight of fixed-point colour sums; all zero without weight.
VoxelColor color_of(const ColorTotals& totals);

}  // namespace roxel

#pragma once
/// Neighbouring rays of one camera walked side by side: what LatticeStack::walk_chunks does for one ray,
/// several times faster where rays are many. Which bricks the rays may meet is known (BrickLists); each ray
/// takes its own, and inside bricks all go from cell to cell together, in vector registers.

#include <memory>
#include <span>

#include "roxel/march/packet_steps.h"
#include "roxel/march/ray_walk.h"

namespace roxel {

class PacketWalk {
 public:
  explicit PacketWalk(const LatticeStack& stack);
  ~PacketWalk();

  /// Rays in a packet on this machine: 4, 8 or 16.
  static int rays();

  /// Begins a packet of rays from `origin` within the depths of `range`. `bricks` are those that they may
  /// meet (LatticeStack::brick), in an order in which no ray meets a later one first; they must stay.
  void begin(const Eigen::Vector3d& origin, Stretch range, std::span<const std::uint32_t> bricks);
  /// Adds the packet's ray number `ray` (0 <= ray < rays()), which goes through origin + depth * direction.
  void add(int ray, const Eigen::Vector3d& direction);
  /// The ray needs no more steps.
  void stop(int ray) { running_ &= ~(1u << ray); }
  /// The steps of each ray in the next brick that it meets; false where no ray meets any more. There may be
  /// bricks without steps.
  bool next(PacketSteps& steps);

 private:
  struct State;
  struct Found;
  void look_for_bricks();
  void take_next_crossings(PacketSteps& steps);

  const LatticeStack& stack_;
  std::unique_ptr<State> state_;
  Eigen::Vector3d origin_;
  Stretch range_{0, 0};
  std::span<const std::uint32_t> bricks_;
  std::size_t next_brick_ = 0;  ///< in bricks_
  int found_ = 0;               ///< bricks found and perhaps still to be crossed
  std::uint32_t running_ = 0;   ///< bit `ray`
  bool prepared_ = true;        ///< no ray has been added since the others were prepared
};

}  // namespace roxel

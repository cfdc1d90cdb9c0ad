#include "roxel/march/packet_walk.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "roxel/march/packet_kernels.h"

namespace roxel {

/// A brick that rays of the packet meet.
struct PacketWalk::Found {
  std::uint32_t number;
  const Brick* brick;
  std::int32_t first_slot;
  double per_voxel;  ///< inverse of the lattice's voxel size
  internal::BrickHits hits;
};

struct PacketWalk::State {
  static constexpr int kMostFound = 24;

  internal::PacketRays rays;
  Found found[kMostFound];
  /// Bricks that each ray has still to cross, in order: numbers of `found`.
  std::uint8_t waiting[kMaxPacketRays][kMostFound];
  std::uint8_t first[kMaxPacketRays], end[kMaxPacketRays];
  internal::BrickCrossings crossings;
};

PacketWalk::PacketWalk(const LatticeStack& stack) : stack_(stack), state_(std::make_unique<State>()) {
  std::fill(state_->rays.direction[0], state_->rays.direction[0] + kMaxPacketRays, 1.0);  // of rays not added
}
PacketWalk::~PacketWalk() = default;

int PacketWalk::rays() {
  static const int lanes = internal::packet_lanes();
  return lanes;
}

void PacketWalk::begin(const Eigen::Vector3d& origin, Stretch range, std::span<const std::uint32_t> bricks) {
  origin_ = origin;
  range_ = range;
  bricks_ = bricks;
  next_brick_ = 0;
  found_ = 0;
  running_ = 0;
}

void PacketWalk::add(int ray, const Eigen::Vector3d& direction) {
  for (int a = 0; a < 3; ++a) state_->rays.direction[a][ray] = direction[a];
  state_->first[ray] = state_->end[ray] = 0;
  running_ |= 1u << ray;
  prepared_ = false;
}

/// Finds bricks until each ray has one to cross, or there are no more.
void PacketWalk::look_for_bricks() {
  State& s = *state_;
  std::uint32_t idle = 0, busy = 0;
  for (std::uint32_t rays = running_; rays != 0; rays &= rays - 1) {
    const int ray = std::countr_zero(rays);
    (s.first[ray] == s.end[ray] ? idle : busy) |= 1u << ray;
  }
  if (busy == 0) {  // all that was found is done with
    found_ = 0;
    for (std::uint32_t rays = idle; rays != 0; rays &= rays - 1) {
      const int ray = std::countr_zero(rays);
      s.first[ray] = s.end[ray] = 0;
    }
  }
  while (idle != 0 && next_brick_ < bricks_.size() && found_ < State::kMostFound) {
    Found& found = s.found[found_];
    const std::uint32_t number = bricks_[next_brick_++];
    const int lattice = stack_.lattice_of(number);
    const BrickIndex& index = stack_.volume().index(lattice);
    const LatticeFrame& frame = index.frame();
    const std::uint32_t in_lattice = number - stack_.first_brick(lattice);
    const Brick& brick = index.bricks()[in_lattice];
    if (next_brick_ + 1 < bricks_.size())
      if (const std::uint32_t after = bricks_[next_brick_ + 1] - stack_.first_brick(lattice);
          after < index.bricks().size())
        __builtin_prefetch(index.bricks()[after].coord.data());
    const double side = kBrickSide * frame.voxel_size;
    double lo[3], hi[3];
    for (int a = 0; a < 3; ++a) {
      // The same plane is the same number, whichever of the bricks beside it asks.
      lo[a] = frame.origin[a] + side * brick.coord[a] - origin_[a];
      hi[a] = frame.origin[a] + side * (brick.coord[a] + 1) - origin_[a];
    }
    const std::uint32_t meet =
        internal::meet_brick(s.rays, lo, hi, range_.begin, range_.end, found.hits) & running_;
    if (meet == 0) continue;
    found.number = number;
    found.brick = &brick;
    __builtin_prefetch(brick.word.data());
    found.first_slot = static_cast<std::int32_t>(brick.first_slot);
    found.per_voxel = 1 / frame.voxel_size;
    for (std::uint32_t rays = meet; rays != 0; rays &= rays - 1) {
      const int ray = std::countr_zero(rays);
      s.waiting[ray][s.end[ray]++] = static_cast<std::uint8_t>(found_);
    }
    ++found_;
    idle &= ~meet;
  }
}

/// Sets up each ray's next crossing.
void PacketWalk::take_next_crossings(PacketSteps& steps) {
  State& s = *state_;
  internal::BrickCrossings& c = s.crossings;
  steps.brick_count = 0;
  for (int ray = 0, count = rays(); ray < count; ++ray) {
    if ((running_ >> ray & 1) == 0 || s.first[ray] == s.end[ray]) {
      c.length[ray] = 0;
      c.to_exit[0][ray] = c.to_exit[1][ray] = c.to_exit[2][ray] = 0;
      continue;
    }
    const Found& found = s.found[s.waiting[ray][s.first[ray]++]];
    const double scale = s.rays.arc_per_depth[ray] * found.per_voxel;
    for (int a = 0; a < 3; ++a) c.to_exit[a][ray] = found.hits.to_exit[a][ray] * scale;
    c.length[ray] = std::max(found.hits.length[ray] * scale, 1.0);
    c.brick[ray] = found.brick;
    c.first_slot[ray] = found.first_slot;
    if (steps.brick_count == 0 || steps.bricks[steps.brick_count - 1] != found.number)
      steps.bricks[steps.brick_count++] = found.number;
  }
}

bool PacketWalk::next(PacketSteps& steps) {
  if (!std::exchange(prepared_, true)) internal::prepare_rays(state_->rays);
  look_for_bricks();
  take_next_crossings(steps);
  if (steps.brick_count == 0) return false;
  internal::walk_crossings(state_->rays, state_->crossings, steps);
  return true;
}

}  // namespace roxel

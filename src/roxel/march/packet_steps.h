#pragma once
/// Steps of neighbouring rays that were walked side by side.

#include <cstdint>

namespace roxel {

/// Most rays in a packet; how many they are on this machine says PacketWalk::rays().
inline constexpr int kMaxPacketRays = 16;

/// The steps of a packet's rays in one brick each, without gaps: row by row, and in a row ray by ray. Row k
/// has the k-th cells of all rays, as far as there are voxels.
///
///     cells met      ray 0   ray 1   ray 2   ray 3        kept
///     row 0            v       -       v       v          v0 v2 v3      rays[0] = 1101b
///     row 1            v       v               -          v0 v1         rays[1] = 0011b
///
struct alignas(64) PacketSteps {
  static constexpr int kMaxRows = 24;  ///< a ray meets at most 3 x 8 - 2 cells of a brick
  static constexpr int kMost = kMaxRows * kMaxPacketRays;
  /// Arrays are read in whole vectors: the kMaxPacketRays entries behind the count are good slots, ray 0, and
  /// no length and weight.
  static constexpr int kPadded = kMost + kMaxPacketRays;

  int count = 0;
  int rows = 0;
  std::uint32_t rays[kMaxRows];  ///< bit `ray`: it has a step in the row
  int brick_count = 0;
  std::uint32_t
      bricks[kMaxPacketRays];  ///< that the steps are in (LatticeStack::brick); some may stand twice

  std::uint32_t slot[kPadded];
  float length[kPadded];      ///< chord, in voxel lengths of the lattice; above 0
  float weight[kPadded];      ///< ray weight, as VoxelStep::weight
  std::int32_t ray[kPadded];  ///< whose step it is
};

}  // namespace roxel

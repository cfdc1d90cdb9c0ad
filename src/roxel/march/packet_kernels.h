#pragma once
/// The inner loops of PacketWalk, written once for vectors of any width and compiled for several; which one
/// runs is decided when the program starts. A packet has as many rays as a vector has floats: arrays are made
/// for the widest.

#include <cstdint>

#include "roxel/march/packet_steps.h"
#include "roxel/volume/volume.h"

namespace roxel::internal {

/// Rays from one origin, an axis. All but the direction is made by prepare_rays.
struct alignas(64) PacketRays {
  double direction[3][kMaxPacketRays];
  double
      arc_per_depth[kMaxPacketRays];  ///< world units of arc a unit of depth, in kPacketUnit of a voxel of 1
  double inverse[3][kMaxPacketRays];  ///< of the direction, in units of depth a world unit; finite
  float unit[3][kMaxPacketRays];      ///< direction of length 1
  // What is the same in every brick; positions along a ray are in kPacketUnit of its arc:
  double distance[3][kMaxPacketRays];      ///< between planes of cells
  double per_distance[3][kMaxPacketRays];  ///< its inverse
  std::int32_t delta[3][kMaxPacketRays];   ///< distance, cut at kPacketFar
  std::int32_t step[3][kMaxPacketRays];    ///< of voxel_in_brick when a plane is passed
  /// With m planes between the point of entry and the plane where the ray would leave the brick, the ray
  /// enters cell last_cell - m step, at last_place - m' sign (m' counts parts of cells).
  std::int32_t last_cell[3][kMaxPacketRays];
  float last_place[3][kMaxPacketRays];
  float sign[3][kMaxPacketRays];
};

/// Positions within a brick count from where the ray enters, in these parts of a voxel length.
inline constexpr double kPacketUnit = 1.0 / (1 << 26);
/// Beyond any brick's far side, and twice that is still an integer.
inline constexpr std::int32_t kPacketFar = (1 << 30) - 1;

/// What a packet's rays have of one brick, in units of depth; only where a ray meets it.
struct alignas(64) BrickHits {
  double to_exit[3][kMaxPacketRays];  ///< from entering to the plane where the brick ends, an axis
  double length[kMaxPacketRays];      ///< from entering to leaving
};

/// One crossing of a brick a ray: what the walk from cell to cell needs and finds.
struct alignas(64) BrickCrossings {
  double to_exit[3][kMaxPacketRays];  ///< as in BrickHits, in kPacketUnit of arc
  double length[kMaxPacketRays];      ///< 0: the ray crosses nothing
  const Brick* brick[kMaxPacketRays];
  std::int32_t first_slot[kMaxPacketRays];

  // Found:
  float to_centre[3][kMaxPacketRays];  ///< from where the ray enters to the centre of the brick's first cell
  std::int32_t count[kMaxPacketRays];  ///< cells met
  std::int32_t cell[PacketSteps::kMaxRows][kMaxPacketRays];
  float chord[PacketSteps::kMaxRows][kMaxPacketRays];  ///< 0 where there is no cell
};

/// Floats in a vector: rays in a packet.
int packet_lanes();
/// Fills in what follows from the directions. A ray is never quite along planes: what it strays by is far
/// below a voxel.
void prepare_rays(PacketRays& rays);
/// Which rays meet the brick between `lo` and `hi` (relative to the rays' origin) within the depths
/// [begin, end): bit `lane`.
std::uint32_t meet_brick(const PacketRays& rays, const double lo[3], const double hi[3], double begin,
                         double end, BrickHits& hits);
/// Walks all crossings from cell to cell, and appends the existing voxels to `steps`, row after row.
void walk_crossings(const PacketRays& rays, BrickCrossings& crossings, PacketSteps& steps);

}  // namespace roxel::internal

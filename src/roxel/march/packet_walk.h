#pragma once
/// Eight neighbouring rays walked side by side: what LatticeStack::walk_chunks does for one ray, several
/// times faster where rays are many. Each ray finds its bricks by itself; inside bricks all eight go cell by
/// cell together, in vector registers.

#include "roxel/base/lanes.h"
#include "roxel/march/ray_walk.h"

namespace roxel {

/// Steps of eight rays, in ray order: entry (row, lane) is the row-th step of the lane's ray in this round.
/// Where a lane has fewer steps than others, its slot is another lane's and length and weight are 0.
struct alignas(64) StepRows {
  static constexpr int kMaxRows = 48;
  static constexpr int kMaxBricks = 16;

  int rows = 0;                      ///< of the lane with most steps
  int count[kLanes];                 ///< steps of each lane
  int brick_count = 0;               ///< bricks that the steps are in
  std::uint32_t bricks[kMaxBricks];  ///< their numbers (LatticeStack::brick); some stand twice
  std::uint8_t begins[kMaxRows];     ///< bit `lane`: the lane's first step in a brick, where segments break
  std::uint32_t slot[kMaxRows][kLanes];
  float length[kMaxRows][kLanes];  ///< chord, in voxel lengths of the lattice
  float weight[kMaxRows][kLanes];  ///< ray weight, as VoxelStep::weight
};

/// Eight crossings of a brick by a ray, one a lane, as arrays.
struct alignas(64) BrickCrossings {
  static constexpr int kMaxCells = 24;  ///< a ray meets at most 3 x 8 - 2 cells of a brick
  /// Unit of positions within a brick, in voxel lengths; they count from where the ray enters.
  static constexpr double kUnit = 1.0 / (1 << 26);

  // Of the ray in its lattice, an axis:
  double distance[3][kLanes];      ///< between planes, in kWalkUnit; 0 when the ray runs along them
  double per_distance[3][kLanes];  ///< its inverse; 0 when the ray runs along them
  std::int32_t delta[3][kLanes];   ///< distance in kUnit
  std::int32_t step[3][kLanes];    ///< of voxel_in_brick when a plane is passed
  float direction[3][kLanes];      ///< unit
  /// With m planes between the point of entry and the plane where the ray would leave the brick, the ray
  /// enters cell last_cell - m step, at last_place - m' sign (m' counts parts of cells).
  std::int32_t last_cell[3][kLanes];
  float last_place[3][kLanes];
  float sign[3][kLanes];  ///< 1, -1; 0 when the ray runs along the planes

  // Of the crossing:
  double to_exit[3][kLanes];  ///< from entering to the plane where the brick ends, an axis, in kWalkUnit
  std::int32_t end[kLanes];   ///< where the crossing ends, in kUnit; 0: there is none

  // Results:
  std::int32_t count[kLanes];  ///< cells met
  std::int32_t cells[kMaxCells][kLanes];
  float length[kMaxCells][kLanes];
  float weight[kMaxCells][kLanes];  ///< 0 also where the length is

  void walk();
};

class PacketWalk {
 public:
  explicit PacketWalk(const LatticeStack& stack);

  /// Puts a ray into a lane; `range` and `sight` as for LatticeStack::walk_chunks.
  void begin(int lane, const Ray& ray, Stretch range, const Stretch* sight);
  /// The lane's ray needs no more steps.
  void stop(int lane) { lanes_[lane].running = false; }
  /// The steps in the next bricks of each ray; false where no ray meets any more.
  bool next(StepRows& steps);

 private:
  /// One ray's way from brick to brick. Positions are in kWalkUnit.
  struct Lane {
    bool running = false;
    bool fresh;  ///< the brick to come has not been looked at
    Ray ray;
    std::vector<std::pair<int, Stretch>> segments;  ///< lattice and depths to come, last first
    int lattice;
    const std::int32_t* table;
    const Brick* bricks;
    std::ptrdiff_t index;    ///< into table, of the brick to come
    std::int64_t in, end;    ///< where the ray enters the brick, and where its stretch ends
    std::int64_t leaves[3];  ///< where it leaves the brick, an axis
    std::int64_t brick_distance[3];
    std::ptrdiff_t stride[3];  ///< of index
    int ahead[3];              ///< bricks from here to the frame's border
  };

  /// Bricks that a ray crosses in a round: more fill the rows better, fewer leave less to throw away where
  /// rays end.
  static constexpr int kBricksARound = 2;

  void open_segment(int lane);
  const Brick* find_brick(int lane);
  static const Brick* search(Lane& lane);
  void set_up_crossing(int lane);
  void append(int lane, const Brick& brick, StepRows& steps) const;
  static void pad(StepRows& steps);

  const LatticeStack& stack_;
  Lane lanes_[kLanes];
  BrickCrossings crossings_;
};

}  // namespace roxel

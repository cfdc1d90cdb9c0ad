#pragma once
/// Evaluates eight samples at once against the voxels along their rays, and gives responsibilities out: what
/// SegmentMarch does for one sample where filters are off and the rule is the posterior one, lane by lane.

#include <memory>

#include "roxel/infer/evidence.h"
#include "roxel/infer/match.h"
#include "roxel/march/packet_walk.h"
#include "roxel/march/segment.h"

namespace roxel {

/// One step of each of eight rays. A lane without a step here has another lane's slot and zeros.
struct alignas(64) EvaluatedRow {
  std::uint32_t slot[kLanes];
  float length[kLanes];
  float weight[kLanes];      ///< ray weight
  float opacity[kLanes];     ///< a
  float likelihood[kLanes];  ///< p
  float mean_path[kLanes];   ///< e
};

/// Rows that grow without being cleared first.
class EvaluatedRows {
 public:
  std::size_t size() const { return size_; }
  const EvaluatedRow* data() const { return rows_.get(); }
  void clear() { size_ = 0; }
  /// Room for so many more, to be written by the caller.
  EvaluatedRow* append(std::size_t count);

 private:
  std::size_t size_ = 0, capacity_ = 0;
  std::unique_ptr<EvaluatedRow[]> rows_;
};

/// What eight rays have met so far: the segments before the brick they are in, and within it.
struct alignas(32) PacketSegments {
  float transmittance[kLanes], likelihood[kLanes];
  float transmittance_in_brick[kLanes], likelihood_in_brick[kLanes];
  std::int32_t running[kLanes];  ///< -1 until nothing behind can matter, then 0
  std::int32_t steps[kLanes];    ///< taken

  PacketSegments();
  Segment of(int lane) const {
    return Segment{transmittance[lane], likelihood[lane]}.then(
        {transmittance_in_brick[lane], likelihood_in_brick[lane]});
  }
};

/// Probabilities of eight rays while they are given out.
struct alignas(32) PacketReach {
  float reach[kLanes] = {};          ///< of getting as far as the first row
  float z[kLanes] = {};              ///< likelihood from there on; lanes with 0 give nothing
  float weight[kLanes] = {};         ///< observation weight
  float transmittance[kLanes] = {};  ///< out: of the rows
};

class PacketMarch {
 public:
  PacketMarch(const LatticeStack& stack, NodeScratch& scratch, const MatchModel& model)
      : scratch_(scratch), model_(model), walk_(stack) {}

  /// Puts a ray into a lane of the next march.
  void begin(int lane, const Ray& ray, Stretch range, const Stretch* sight) {
    walk_.begin(lane, ray, range, sight);
  }
  /// Marches all rays begun and appends their rows. Rays stop early as SegmentMarch's do.
  PacketSegments march(const LaneTerms& samples, EvaluatedRows& rows);

  /// Gives out each lane's `reach` to the voxels of the rows [begin, end): hits, exposure and looked.
  void distribute(const EvaluatedRow* begin, const EvaluatedRow* end, bool ray_weights, PacketReach& lanes);

 private:
  NodeScratch& scratch_;
  const MatchModel& model_;
  PacketWalk walk_;
  StepRows steps_;
  MatchBlock block_;
};

}  // namespace roxel

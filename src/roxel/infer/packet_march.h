#pragma once
/// Evaluates neighbouring samples at once against the voxels along their rays, and gives responsibilities
/// out: what SegmentMarch does for one sample where filters are off and the rule is the posterior one.

#include "roxel/infer/packet_sums.h"
#include "roxel/march/packet_walk.h"
#include "roxel/march/segment.h"

namespace roxel {

class PacketMarch {
 public:
  PacketMarch(const LatticeStack& stack, NodeScratch& scratch, const MatchModel& model)
      : scratch_(scratch), model_(model), walk_(stack) {}

  /// As PacketWalk: the rays of the next march.
  void begin(const Eigen::Vector3d& origin, Stretch range, std::span<const std::uint32_t> bricks) {
    walk_.begin(origin, range, bricks);
  }
  void add(int ray, const Eigen::Vector3d& direction) { walk_.add(ray, direction); }
  /// Marches the first `count` rays, and appends what they say. Rays stop early as SegmentMarch's do.
  PacketSegments march(int count, const PacketTerms& samples, PacketRecord& record);

  /// Gives out each ray's reach to the voxels of the record's steps [begin, end).
  void give_out(PacketRecord& record, std::size_t begin, std::size_t end, bool ray_weights,
                const PacketReach& rays) {
    give_out_reach(record, begin, end, ray_weights, rays, scratch_.voxels());
  }

 private:
  void evaluate(const PacketTerms& samples, PacketSegments& segments, PacketRecord& record);

  NodeScratch& scratch_;
  const MatchModel& model_;
  PacketWalk walk_;
  PacketSteps steps_;
  MatchBlock block_;
};

}  // namespace roxel

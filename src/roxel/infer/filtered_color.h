#pragma once
/// The colour march with the thesis's switches that change a sample along its ray (SampleFilters): what
/// ColorPackets does, ray by ray, with each voxel given the sample as it is there.

#include "roxel/infer/passes.h"
#include "roxel/infer/tiles.h"

namespace roxel {

class FilteredColorMarch {
 public:
  /// `everywhere` as for march_color. What voxels explain is told by the volume's colours, of the last pass.
  FilteredColorMarch(const LatticeStack& stack, const MarchOptions& options, bool everywhere,
                     NodeScratch& scratch)
      : stack_(stack), options_(options), everywhere_(everywhere), scratch_(scratch) {}

  /// Whether the options ask for this march.
  static bool serves(const MarchOptions& options) {
    const SampleFilters& filters = options.filters;
    return filters.rays || filters.interpolate ||
           (filters.background && options.background.kind == BackgroundKind::kKnown);
  }

  /// Gives the region's sample, and those that it divides into, to the voxels along their rays.
  void root(const ViewInSight& in_sight, const Region& region) {
    march(in_sight, region, in_sight.view.plan.range.begin, 1, {});
  }

  PassCounts counts;

 private:
  void march(const ViewInSight& in_sight, const Region& region, double begin, float transmittance,
             RemovedColor removed);
  void deposit(const SampleView& view, const Region& region, const RegionStats& sample, float weight,
               const StepChunk& chunk, float& transmittance, RemovedColor& removed);
  bool goes_on(float transmittance) const;

  const LatticeStack& stack_;
  const MarchOptions& options_;
  bool everywhere_;
  NodeScratch& scratch_;
  StepChunk chunk_;
};

}  // namespace roxel

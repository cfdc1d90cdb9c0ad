#pragma once
/// Evaluates one sample against the voxels along its ray: the part that the opacity passes and depth share.

#include <vector>

#include "roxel/infer/background.h"
#include "roxel/infer/evidence.h"
#include "roxel/infer/sample_view.h"
#include "roxel/march/segment.h"

namespace roxel {

/// A voxel crossed by a sample's ray, with what the sample says about it.
struct EvaluatedStep {
  std::uint32_t slot;
  float length;      ///< chord in voxel lengths
  float weight;      ///< ray weight
  float depth;       ///< along the optical axis, middle of the chord
  float half_chord;  ///< half the chord's extent in depth
  float opacity;     ///< a
  float likelihood;  ///< p
  float mean_path;   ///< e
};

/// The thesis's switches that change a sample along its ray; all off by default.
struct SampleFilters {
  bool rays = false;         ///< remove what a voxel explains from the sample behind it
  bool background = false;   ///< remove the known background's share
  float limit = 0.9f;        ///< nothing is removed where the removed share would reach this
  bool interpolate = false;  ///< colours are interpolated at each voxel centre's projection
};

/// What has been removed from a sample on its way: I' = (I - removed) / transmittance.
struct RemovedColor {
  float transmittance = 1;
  float mean[3] = {0, 0, 0};
  float cov[6] = {0, 0, 0, 0, 0, 0};

  /// Removes a voxel of opacity a and the given colour; leaves all as it is where a >= limit.
  void remove(float a, const float color_mean[3], const float color_cov[6], float limit);
  RegionStats apply(const RegionStats& sample) const;
};

class SegmentMarch {
 public:
  SegmentMarch(const LatticeStack& stack, NodeScratch& scratch, const MatchModel& model,
               const Background& background, const SampleFilters& filters)
      : stack_(stack), scratch_(scratch), model_(model), background_(background), filters_(filters) {}

  /// Marches `ray` over `range` (cut to `sight` unless null, see walk_lattices), appends the steps, and
  /// returns (T, Z) from the range's begin, folded from per-brick segments. Stops early once what lies behind
  /// can change Z by less than kNegligible of itself.
  Segment march(const SampleView& view, const Region& region, const RegionStats& sample, const Ray& ray,
                Stretch range, const Stretch* sight, RemovedColor& removed,
                std::vector<EvaluatedStep>& steps);

  /// Every step of the roxels rule counts, so its rays must not stop early.
  void set_early_stop(bool on) { early_stop_ = on; }

  static constexpr float kNegligible = 1e-3f;

 private:
  bool flush(const SampleView& view, const Region& region, const RegionStats& sample, const StepChunk& chunk,
             RemovedColor& removed, Segment& total, std::vector<EvaluatedStep>& steps);
  void gather(const SampleView& view, const Region& region, const SampleTerms& terms, const StepChunk& chunk);
  RegionStats background_removed(const SampleView& view, const Ray& ray, const RegionStats& sample);

  const LatticeStack& stack_;
  NodeScratch& scratch_;
  const MatchModel& model_;
  const Background& background_;
  const SampleFilters& filters_;
  bool early_stop_ = true;

  StepChunk chunk_;
  MatchBlock block_;
  Segment in_brick_;  ///< the segment of the brick being walked
};

}  // namespace roxel

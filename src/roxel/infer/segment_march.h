#pragma once
/// Evaluates one sample against the voxels along its ray: the part that the opacity passes and depth share.

#include <array>
#include <vector>

#include "roxel/infer/background.h"
#include "roxel/infer/evidence.h"
#include "roxel/infer/match.h"
#include "roxel/infer/sample_view.h"
#include "roxel/march/segment.h"

namespace roxel {

/// A voxel crossed by a sample's ray, with what the sample says about it.
struct EvaluatedStep {
  std::uint32_t slot;
  float length;      ///< chord in voxel lengths
  float weight;      ///< ray weight
  float opacity;     ///< a
  float likelihood;  ///< p
  float mean_path;   ///< e
};

/// Where in depth a step's chord lies.
struct StepDepth {
  float middle;      ///< along the optical axis, of the chord
  float half_chord;  ///< half the chord's extent in depth
};

/// Steps in ray order, kept field by field: the march writes them as it computes them.
class EvaluatedSteps {
 public:
  std::size_t size() const { return size_; }
  void clear() { size_ = 0; }
  EvaluatedStep operator[](std::size_t i) const {
    return {slot_[i],
            field_[kLength][i],
            field_[kWeight][i],
            field_[kOpacity][i],
            field_[kLikelihood][i],
            field_[kMeanPath][i]};
  }
  float likelihood(std::size_t i) const { return field_[kLikelihood][i]; }
  /// Only where the march was asked for depths.
  StepDepth depth(std::size_t i) const { return depth_[i]; }

 private:
  friend class SegmentMarch;
  enum Field { kLength, kWeight, kOpacity, kLikelihood, kMeanPath, kFields };
  void append(const StepChunk& chunk, const MatchBlock& block, int count, bool with_depths);

  std::size_t size_ = 0;
  std::vector<std::uint32_t> slot_;
  std::array<std::vector<float>, kFields> field_;
  std::vector<StepDepth> depth_;
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

/// The sample less what a known background explains of it, if its ray gets that far (--filter-background).
RegionStats without_background(const LatticeStack& stack, const SampleView& view, const Ray& ray,
                               const RegionStats& sample, const Background& background,
                               const SampleFilters& filters, NodeScratch& scratch);
/// The photograph's colour where a voxel's centre projects, for samples of the region's size
/// (--interpolate). Leaves `mean` as it is, and returns false, where nothing there is valid.
bool mean_at_voxel(const SampleView& view, const Region& region, const LatticeFrame& frame,
                   const Eigen::Vector3i& voxel, float mean[3]);

class SegmentMarch {
 public:
  SegmentMarch(const LatticeStack& stack, NodeScratch& scratch, const MatchModel& model,
               const Background& background, const SampleFilters& filters)
      : stack_(stack), scratch_(scratch), model_(model), background_(background), filters_(filters) {}

  /// Marches `ray` over `range` (cut to `sight` unless null, see walk_lattices), appends the steps, and
  /// returns (T, Z) from the range's begin, folded from per-brick segments. Stops early once what lies behind
  /// can change Z by less than kNegligible of itself.
  Segment march(const SampleView& view, const Region& region, const RegionStats& sample, const Ray& ray,
                Stretch range, const Stretch* sight, RemovedColor& removed, EvaluatedSteps& steps);

  /// Every step of the roxels rule counts, so its rays must not stop early.
  void set_early_stop(bool on) { early_stop_ = on; }
  /// Whether steps get their depths, too.
  void set_depths(bool on) { depths_ = on; }

  static constexpr float kNegligible = 1e-3f;

 private:
  bool flush(const SampleView& view, const Region& region, const RegionStats& sample, const StepChunk& chunk,
             RemovedColor& removed, Segment& total, EvaluatedSteps& steps);
  int fold(const StepChunk& chunk, RemovedColor& removed, Segment& total);
  void gather(const SampleView& view, const Region& region, const SampleTerms& terms, const StepChunk& chunk);

  const LatticeStack& stack_;
  NodeScratch& scratch_;
  const MatchModel& model_;
  const Background& background_;
  const SampleFilters& filters_;
  bool early_stop_ = true;
  bool depths_ = false;

  StepChunk chunk_;
  MatchBlock block_;
  Segment in_brick_;  ///< the segment of the brick being walked
};

}  // namespace roxel

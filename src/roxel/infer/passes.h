#pragma once
/// The passes over one node's rays (docs/passes.md). Both write into the worker's NodeScratch only.

#include "roxel/base/run_context.h"
#include "roxel/infer/segment_march.h"

namespace roxel {

enum class UpdateRule {
  kPosterior,  ///< expectation maximisation of the first-surface model
  kRoxels,     ///< [DeBonet99] as in [Jethwa04] section 2.3.2
};

/// Sums over rays that a pass reports; counts and sums of sums, all exact or folded in a fixed order.
struct PassCounts {
  std::int64_t rays = 0;          ///< samples marched
  std::int64_t steps = 0;         ///< existing voxels crossed
  double log_likelihood = 0;      ///< sum over root samples of weight * log Z (posterior rule)
  double observation_weight = 0;  ///< sum of the root samples' weights

  PassCounts& operator+=(const PassCounts& other);
};

/// What the marches of a pass, of colour and of opacity, have in common.
struct MarchOptions {
  UpdateRule rule = UpdateRule::kPosterior;
  MatchModel model;
  Background background;
  SampleFilters filters;
  bool ray_weights = false;  ///< weigh opacity sums by the ray weight, too
};

/// Colour: adds each sample to the voxels along its ray with weight responsibility x ray weight x observation
/// weight, where the responsibility is a_s T_s from the global opacities, or 1 everywhere when `everywhere`.
/// Samples of a known background colour nothing. Filters change the sample that each voxel is given.
PassCounts march_color(const LatticeStack& stack, const SampleNode& node, const MarchOptions& options,
                       bool everywhere, const RunContext& context, NodeScratch& scratch);

/// Opacity: adds each sample's responsibilities to hits, exposure and looked of the voxels that its ray
/// meets. The scratch holds the colours to compare with (NodeScratch::compare_with).
PassCounts march_opacity(const LatticeStack& stack, const SampleNode& node, const MarchOptions& options,
                         const RunContext& context, NodeScratch& scratch);

}  // namespace roxel

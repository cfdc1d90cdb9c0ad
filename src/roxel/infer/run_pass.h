#pragma once
/// One pass over all nodes: colours, then opacities (docs/passes.md).

#include "roxel/infer/update.h"

namespace roxel {

struct PassOptions {
  OpacityPassOptions opacity;
  PriorOptions prior;
  bool predictive = true;   ///< leave a ray's own node out of the colour that it is compared with
  bool everywhere = false;  ///< first pass of all: every responsibility of the colour sums is 1
};

struct PassReport {
  UpdateReport update;
  PassCounts color;
  PassCounts opacity;
  double color_seconds = 0;    ///< wall time of the colour marches that make the totals
  double opacity_seconds = 0;  ///< wall time of the opacity marches, with the node's own colours again
  double opacity_march_cpu_seconds = 0;  ///< summed over workers, of march_opacity alone
  double prior_log_likelihood = 0;       ///< log prior of tau given the field used, up to a constant
};

/// Called after each node of each half of the pass with the share of the pass that is done, from any thread.
using PassProgress = std::function<void(double fraction)>;

/// Updates the volume. Nodes are worked on by whole workers in any order; totals are exact, so the result
/// does not depend on the number of threads.
PassReport run_pass(const std::vector<SampleNode>& nodes, const PassOptions& options,
                    const RunContext& context, const PassProgress& progress, Volume& volume);

/// The first half alone: the totals of colour (and what `totals` needs for leaving nodes out).
PassCounts collect_color(const LatticeStack& stack, const std::vector<SampleNode>& nodes,
                         const PassOptions& options, const RunContext& context, const PassProgress& progress,
                         Totals& totals);

}  // namespace roxel

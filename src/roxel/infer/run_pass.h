#pragma once
/// One pass over all nodes: colours, then opacities (docs/passes.md).

#include <atomic>

#include "roxel/infer/update.h"

namespace roxel {

struct PassOptions {
  MarchOptions opacity;
  PriorOptions prior;
  bool predictive = true;  ///< leave a ray's own node out of the colour that it is compared with
  std::size_t kept_color_bytes = std::size_t{1} << 30;  ///< see KeptColors; changes no result
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
                    const RunContext& context, const PassProgress& progress, Volume& volume,
                    Acceleration* acceleration = nullptr);

/// Own colours of as many nodes as fit into a limit: those need not be marched for again in the second half
/// of a pass. What is kept may depend on the order of arrival; no result does.
class KeptColors {
 public:
  KeptColors(std::size_t node_count, std::size_t limit_bytes);
  /// Called at most once a node; safe from several threads for different nodes.
  void keep(std::size_t node, OwnColors own);
  /// Whether anything more may be kept.
  bool has_room() const { return left_bytes_ > 0; }
  /// Null where the node's colours were not kept.
  const OwnColors* of(std::size_t node) const { return nodes_[node].get(); }

 private:
  std::atomic<std::int64_t> left_bytes_;
  std::vector<std::unique_ptr<OwnColors>> nodes_;
};

/// Colours that rays are compared with: those of all nodes, and what is kept of each node's own.
struct CollectedColors {
  CollectedColors(std::uint32_t slot_count, std::size_t node_count, std::size_t kept_bytes)
      : totals(slot_count), kept(node_count, kept_bytes) {}

  Totals totals;
  KeptColors kept;
  std::vector<VoxelColor> of_totals;
};

/// Makes the scratch hold what the nodes other than nodes[node] say (all nodes without options.predictive).
void compare_with_others(const LatticeStack& stack, const std::vector<SampleNode>& nodes, std::size_t node,
                         const PassOptions& options, const CollectedColors& colors, const RunContext& context,
                         NodeScratch& scratch);

/// The first half alone: the colours.
PassCounts collect_color(const LatticeStack& stack, const std::vector<SampleNode>& nodes,
                         const PassOptions& options, const RunContext& context, const PassProgress& progress,
                         CollectedColors& colors);

}  // namespace roxel

#pragma once
/// One pass over all nodes: colours, then opacities (docs/passes.md).

#include <algorithm>
#include <atomic>
#include <limits>

#include "roxel/infer/update.h"

namespace roxel {

struct PassOptions {
  MarchOptions opacity;
  PriorOptions prior;
  bool predictive = true;  ///< leave a ray's own node out of the colour that it is compared with
  std::size_t kept_color_bytes = std::size_t{1} << 30;  ///< see KeptColors; changes no result
  /// Threads that march at once, each with a scratch of 64 bytes a voxel; changes no result.
  int most_workers = std::numeric_limits<int>::max();
  bool everywhere = false;  ///< first pass of all: every responsibility of the colour sums is 1
};

struct PassReport {
  UpdateReport update;
  PassCounts color;
  PassCounts opacity;
  double color_seconds = 0;    ///< wall time of the colour marches that make the totals
  double opacity_seconds = 0;  ///< wall time of the opacity marches, with the node's own colours again
  double color_march_cpu_seconds = 0;    ///< summed over workers, of the march that makes the totals alone
  double opacity_march_cpu_seconds = 0;  ///< summed over workers, of march_opacity alone
  double prior_log_likelihood = 0;       ///< log prior of tau given the field used, up to a constant
};

/// Threads that march at once.
inline int worker_count(const PassOptions& options, const RunContext& context) {
  return std::clamp(options.most_workers, 1, context.thread_count());
}

/// Called after each node of each half of the pass with the share of the pass that is done, from any thread.
using PassProgress = std::function<void(double fraction)>;

/// Own colours of as many nodes as fit into a limit: those need not be marched for again in the second half
/// of a pass. What is kept may depend on the order of arrival; no result does.
class KeptColors {
 public:
  KeptColors(std::size_t node_count, std::size_t limit_bytes);
  /// Forgets all colours, but not the memory that they lay in.
  void clear();
  /// Where a node's colours may be put, empty, or null without room. Then say keep(node). Safe from several
  /// threads for different nodes, at most once a node.
  OwnColors* room_for(std::size_t node);
  /// Keeps what was put there, unless it is more than there was room for.
  void keep(std::size_t node);
  std::size_t node_count() const { return nodes_.size(); }
  /// Null where the node's colours were not kept.
  const OwnColors* of(std::size_t node) const { return nodes_[node].kept ? &nodes_[node].colors : nullptr; }

 private:
  struct Node {
    bool kept = false;
    std::size_t held_bytes = 0;  ///< that count against the limit: the most that was kept here
    OwnColors colors;
  };
  std::int64_t limit_bytes_;
  std::atomic<std::int64_t> left_bytes_;
  std::vector<Node> nodes_;
};

/// Colours that rays are compared with: those of all nodes, and what is kept of each node's own.
struct CollectedColors {
  CollectedColors(std::uint32_t slot_count, std::size_t node_count, std::size_t kept_bytes)
      : totals(slot_count), kept(node_count, kept_bytes) {}

  Totals totals;
  KeptColors kept;
  double march_cpu_seconds = 0;  ///< of the marches that made them, summed over workers
};

/// Makes the scratch hold what the nodes other than number `node_idx` say (all nodes without
/// options.predictive). `views` are that node's, in memory.
void compare_with_others(const LatticeStack& stack, const SampleNode& views, std::size_t node_idx,
                         const PassOptions& options, const CollectedColors& colors, const RunContext& context,
                         NodeScratch& scratch);

/// What passes over one volume and its nodes work in: kept from one to the next, it is not taken from the
/// system and given back each time.
class PassMemory {
 public:
  /// What was collected last, or room for it.
  CollectedColors& colors(std::uint32_t slot_count, std::size_t node_count, std::size_t kept_bytes);
  /// A worker's scratch, reset; made when the worker first needs it.
  NodeScratch& scratch(int worker, const LatticeStack& stack, const std::vector<float>& tau);
  /// Room for the scratch of so many workers.
  void set_workers(int count);
  /// Gives all of it back.
  void release() { scratch_.clear(), colors_.reset(); }

 private:
  std::vector<std::unique_ptr<NodeScratch>> scratch_;
  std::unique_ptr<CollectedColors> colors_;
};

/// The first half alone: the colours.
PassCounts collect_color(const LatticeStack& stack, const std::vector<SampleNode>& nodes,
                         const PassOptions& options, const RunContext& context, const PassProgress& progress,
                         CollectedColors& colors, PassMemory* memory = nullptr);

/// Updates the volume. Nodes whose pyramids are not in memory have them made in each half of the pass, one
/// node a worker at once. Nodes are worked on by whole workers in any order; totals are exact, so the result
/// does not depend on the number of threads. `memory`, where it is kept for the next pass, changes no result.
PassReport run_pass(const std::vector<SampleNode>& nodes, const PassOptions& options,
                    const RunContext& context, const PassProgress& progress, Volume& volume,
                    Acceleration* acceleration = nullptr, PassMemory* memory = nullptr);

}  // namespace roxel

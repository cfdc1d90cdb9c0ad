#include "roxel/infer/passes.h"

#include <cmath>

#include "roxel/infer/color_packets.h"
#include "roxel/infer/filtered_color.h"
#include "roxel/infer/opacity_packets.h"

namespace roxel {

PassCounts& PassCounts::operator+=(const PassCounts& other) {
  rays += other.rays;
  steps += other.steps;
  log_likelihood += other.log_likelihood;
  observation_weight += other.observation_weight;
  return *this;
}

namespace {

/// One sample of the tree that a root sample divides into: its own stretch of steps and what its children
/// add.
struct TreeNode {
  std::uint32_t first_step = 0;
  std::uint32_t end_step = 0;
  float weight = 0;         ///< observation weight
  float behind = 0;         ///< leaves: p_bg; inner: product of Z_c^{share}
  float z = 0;              ///< of its own stretch and what is behind it
  float best_path_sum = 0;  ///< roxels: agreements of its stretch and of the best leaf path behind it
  int children[4] = {-1, -1, -1, -1};
};

class OpacityMarch {
 public:
  OpacityMarch(const LatticeStack& stack, const MarchOptions& options, NodeScratch& scratch)
      : options_(options),
        scratch_(scratch),
        march_(stack, scratch, options.model, options.background, options.filters) {
    march_.set_early_stop(options.rule == UpdateRule::kPosterior);
  }

  void root(const ViewInSight& in_sight, const Region& region) {
    tree_.clear();
    steps_.clear();
    const int top = build(in_sight, region, in_sight.view.plan.range.begin, RemovedColor{});
    if (top < 0) return;
    const TreeNode& node = tree_[top];
    counts.observation_weight += node.weight;
    if (options_.rule == UpdateRule::kPosterior) {
      counts.log_likelihood += node.weight * std::log(std::max(node.z, 1e-30f));
      distribute_posterior(top, 1.0f);
    } else {
      distribute_roxels(top, std::max(node.best_path_sum, 1e-30f), 0.0f);
    }
  }

  PassCounts counts;

 private:
  /// Marches the region and, depth first, its children; returns its index in tree_, or -1 without valid
  /// pixels.
  int build(const ViewInSight& in_sight, const Region& region, double begin, RemovedColor removed) {
    const SampleView& view = in_sight.view;
    const RegionStats sample = view.pyramid->at(region.level, region.x, region.y);
    if (sample.valid <= 0) return -1;
    const int self = static_cast<int>(tree_.size());
    const std::uint32_t first_step = static_cast<std::uint32_t>(steps_.size());
    tree_.emplace_back();
    const Stretch range = served_range(view, region, begin);
    const Eigen::Vector2d at = region_centre(view, region);
    const Stretch* sight = range.end > range.begin ? in_sight.sight.within(at.x(), at.y(), range) : nullptr;
    Segment own;
    if (sight) {
      ++counts.rays;
      own =
          march_.march(view, region, sample, view.camera.ray(at.x(), at.y()), range, sight, removed, steps_);
    }
    const std::uint32_t end_step = static_cast<std::uint32_t>(steps_.size());
    counts.steps += end_step - first_step;

    const bool ends = range.end >= view.plan.range.end || region.level == view.plan.finest_level;
    const bool spent = options_.rule == UpdateRule::kPosterior &&
                       own.transmittance < SegmentMarch::kNegligible * own.likelihood;
    Behind behind;
    if (!ends && !spent)
      behind = add_children(in_sight, region, std::max(range.begin, range.end), removed, self);
    float background = 0;
    if (ends || spent || behind.z <= 0) {
      background = background_likelihood(options_.background, options_.model, view, sample);
      if (ends || spent) behind.z = background;
      behind.best_path_sum = std::max(behind.best_path_sum, background);
    }
    TreeNode& node = tree_[self];
    node.first_step = first_step;
    node.end_step = end_step;
    node.weight = observation_weight(view, region, sample);
    node.behind = behind.z;
    node.z = own.likelihood + own.transmittance * behind.z;
    node.best_path_sum = behind.best_path_sum;
    if (options_.rule == UpdateRule::kRoxels)
      for (std::uint32_t s = first_step; s < end_step; ++s) node.best_path_sum += steps_.likelihood(s);
    return self;
  }

  /// What a sample's children say of what lies behind its stretch.
  struct Behind {
    float z = 0;              ///< prod Z_c^{share}
    float best_path_sum = 0;  ///< roxels: of agreements, along the best leaf path
  };

  /// The four children are quarter-weight observations of what lies behind: behind = prod Z_c^{share}.
  Behind add_children(const ViewInSight& in_sight, const Region& region, double begin,
                      const RemovedColor& removed, int parent) {
    Behind behind;
    float total = 0, log_sum = 0;
    for (int c = 0; c < 4; ++c) {
      const Region child = region.child(c);
      if (!inside(in_sight.view, child)) continue;
      const int index = build(in_sight, child, begin, removed);
      tree_[parent].children[c] = index;
      if (index < 0) continue;
      total += tree_[index].weight;
      log_sum += tree_[index].weight * std::log(std::max(tree_[index].z, 1e-30f));
      behind.best_path_sum = std::max(behind.best_path_sum, tree_[index].best_path_sum);
    }
    if (total > 0) behind.z = std::exp(log_sum / total);
    return behind;
  }

  /// Gives out probability `reach` (of the ray getting as far as this sample's stretch) to its voxels and
  /// children.
  void distribute_posterior(int index, float reach) {
    const TreeNode& node = tree_[index];
    if (node.z <= 0) return;
    const float scale = reach / node.z;
    float transmittance = 1, remaining = reach;
    for (std::uint32_t s = node.first_step; s < node.end_step; ++s) {
      const EvaluatedStep step = steps_[s];
      const float r = std::min(scale * transmittance * step.opacity * step.likelihood, remaining);
      VoxelScratch& voxel = scratch_[step.slot];
      const float w = options_.ray_weights ? node.weight * step.weight : node.weight;
      voxel.hits += w * r;
      voxel.exposure += w * ((remaining - r) * step.length + r * step.mean_path);
      voxel.looked = std::max(voxel.looked, remaining * step.weight);
      remaining -= r;
      transmittance *= 1 - step.opacity;
    }
    const float onward = reach * transmittance * node.behind / node.z;
    for (const int child : node.children)
      if (child >= 0 && onward > 1e-6f) distribute_posterior(child, onward);
  }

  /// [Jethwa04] section 2.3.2 steps 3 and 4, normalised by the largest sum over the leaf paths
  /// (section 5.1.1).
  void distribute_roxels(int index, float path_sum, float explained) {
    const TreeNode& node = tree_[index];
    for (std::uint32_t s = node.first_step; s < node.end_step; ++s) {
      const EvaluatedStep step = steps_[s];
      const float r = step.likelihood / path_sum;
      const float alpha = std::min(r / std::max(1 - explained, 1e-6f), 1.0f);
      VoxelScratch& voxel = scratch_[step.slot];
      const float w = node.weight * (options_.ray_weights ? step.weight : 1.0f) * r;
      voxel.hits += w;
      voxel.exposure += w * alpha;
      voxel.looked = std::max(voxel.looked, (1 - explained) * step.weight);
      explained = std::min(explained + r, 1.0f);
    }
    for (const int child : node.children)
      if (child >= 0) distribute_roxels(child, path_sum, explained);
  }

  const MarchOptions& options_;
  NodeScratch& scratch_;
  SegmentMarch march_;
  std::vector<TreeNode> tree_;
  EvaluatedSteps steps_;
};

}  // namespace

PassCounts march_color(const LatticeStack& stack, const SampleNode& node, const MarchOptions& options,
                       bool everywhere, const RunContext& context, NodeScratch& scratch) {
  if (FilteredColorMarch::serves(options)) {
    FilteredColorMarch march(stack, options, everywhere, scratch);
    for_each_root(stack, node, context,
                  [&](const ViewInSight& in_sight, const Region& region) { march.root(in_sight, region); });
    return march.counts;
  }
  ColorPackets packets(stack, options, everywhere, scratch);
  for_each_tile<ListedView>(stack, node, context,
                            [&](const ListedView& view, const Tile& tile) { packets.tile(view, tile); });
  return packets.counts;
}

PassCounts march_opacity(const LatticeStack& stack, const SampleNode& node, const MarchOptions& options,
                         const RunContext& context, NodeScratch& scratch) {
  if (OpacityPackets::serves(options)) {
    OpacityPackets packets(stack, options, scratch);
    for_each_tile<ListedView>(stack, node, context,
                              [&](const ListedView& view, const Tile& tile) { packets.tile(view, tile); });
    return packets.counts;
  }
  OpacityMarch march(stack, options, scratch);
  for_each_root(stack, node, context,
                [&](const ViewInSight& in_sight, const Region& region) { march.root(in_sight, region); });
  return march.counts;
}

}  // namespace roxel

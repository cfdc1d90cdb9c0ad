#include "roxel/infer/run_pass.h"

#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numeric>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"

namespace roxel {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Processor time of the calling thread, in seconds: what a shared machine does meanwhile does not count.
double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Big nodes first, so that no worker is left with one at the end.
std::vector<int> by_size(const std::vector<SampleNode>& nodes) {
  std::vector<int> order(nodes.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return nodes[a].size() > nodes[b].size(); });
  return order;
}

PassCounts sum(const std::vector<PassCounts>& per_node) {
  PassCounts total;
  for (const PassCounts& counts : per_node) total += counts;
  return total;
}

template <class Work>
std::vector<PassCounts> for_each_node(const std::vector<SampleNode>& nodes, int workers,
                                      const RunContext& context, const PassProgress& progress, double from,
                                      double to, const Work& work) {
  const std::vector<int> order = by_size(nodes);
  std::vector<PassCounts> counts(nodes.size());
  std::atomic<int> done{0};
  parallel_for(nodes.size(), workers, [&](std::int64_t i, int worker) {
    context.throw_if_cancelled();
    counts[order[i]] = work(order[i], worker);
    if (progress) progress(from + (to - from) * (++done) / static_cast<double>(nodes.size()));
  });
  return counts;
}

/// Sum over voxels of beta (tau_0 log tau - tau): the Gamma prior's logarithm, mode tau_0.
double log_prior(const Volume& volume, const std::vector<float>& prior_opacity, double strength) {
  double total = 0;
  for (std::uint32_t slot = 0; slot < volume.slot_count(); ++slot) {
    const double tau_0 = -std::log1p(-std::min(prior_opacity[slot], 0.999999f));
    const double tau = std::max(static_cast<double>(volume.tau[slot]), 1e-30);
    total += strength * (tau_0 * std::log(tau) - tau);
  }
  return total;
}

}  // namespace

PassCounts collect_color(const LatticeStack& stack, const std::vector<SampleNode>& nodes,
                         const PassOptions& options, const RunContext& context, const PassProgress& progress,
                         CollectedColors& colors, PassMemory* memory) {
  PassMemory own_memory;
  PassMemory& used = memory ? *memory : own_memory;
  const int workers = worker_count(options, context);
  used.set_workers(workers);
  colors.totals.clear_color();
  colors.kept.clear();
  std::vector<double> march_seconds(workers, 0.0);
  const PassCounts counts =
      sum(for_each_node(nodes, workers, context, progress, 0, 0.3, [&](int node, int worker) {
        NodeScratch& scratch = used.scratch(worker, stack, stack.volume().tau);
        const SampleNode views = resident(nodes[node]);
        const double march_start = thread_seconds();
        const PassCounts node_counts =
            march_color(stack, views, options.opacity, options.everywhere, context, scratch);
        march_seconds[worker] += thread_seconds() - march_start;
        OwnColors* own = options.predictive ? colors.kept.room_for(node) : nullptr;
        colors.totals.add_color(stack, scratch, own);
        if (own) colors.kept.keep(node);
        return node_counts;
      }));
  colors.march_cpu_seconds = std::accumulate(march_seconds.begin(), march_seconds.end(), 0.0);
  return counts;
}

void compare_with_others(const LatticeStack& stack, const SampleNode& views, std::size_t node_idx,
                         const PassOptions& options, const CollectedColors& colors, const RunContext& context,
                         NodeScratch& scratch) {
  const OwnColors* own = options.predictive ? colors.kept.of(node_idx) : nullptr;
  if (own) return scratch.compare_with(colors.totals.color, *own);
  if (options.predictive) march_color(stack, views, options.opacity, options.everywhere, context, scratch);
  scratch.compare_with(colors.totals.color);
}

KeptColors::KeptColors(std::size_t node_count, std::size_t limit_bytes)
    : limit_bytes_(static_cast<std::int64_t>(limit_bytes)), left_bytes_(limit_bytes_), nodes_(node_count) {}

void KeptColors::clear() {
  // What nodes hold is theirs until they are asked again: memory that is given back is taken anew page by
  // page.
  std::int64_t held = 0;
  for (Node& node : nodes_) {
    node.kept = false;
    node.colors.clear();
    held += static_cast<std::int64_t>(node.held_bytes);
  }
  left_bytes_ = limit_bytes_ - held;
}

OwnColors* KeptColors::room_for(std::size_t node) {
  if (limit_bytes_ <= 0 || (left_bytes_ <= 0 && nodes_[node].held_bytes == 0)) return nullptr;
  return &nodes_[node].colors;
}

void KeptColors::keep(std::size_t node) {
  Node& n = nodes_[node];
  const auto held = static_cast<std::int64_t>(n.held_bytes);
  const auto more = std::max<std::int64_t>(static_cast<std::int64_t>(n.colors.bytes()) - held, 0);
  n.kept = more == 0 || left_bytes_.fetch_sub(more) >= more;
  if (n.kept) {
    n.held_bytes += static_cast<std::size_t>(more);
    return;
  }
  left_bytes_ += more + held;
  n = {};
}

CollectedColors& PassMemory::colors(std::uint32_t slot_count, std::size_t node_count,
                                    std::size_t kept_bytes) {
  if (!colors_) colors_ = std::make_unique<CollectedColors>(slot_count, node_count, kept_bytes);
  ROXEL_CHECK(colors_->totals.color.size() == slot_count && colors_->kept.node_count() == node_count);
  return *colors_;
}

void PassMemory::set_workers(int count) {
  if (static_cast<int>(scratch_.size()) < count) scratch_.resize(count);
}

NodeScratch& PassMemory::scratch(int worker, const LatticeStack& stack, const std::vector<float>& tau) {
  if (!scratch_[worker]) scratch_[worker] = std::make_unique<NodeScratch>(stack, tau);
  scratch_[worker]->reset(stack, tau);
  return *scratch_[worker];
}

PassReport run_pass(const std::vector<SampleNode>& nodes, const PassOptions& options,
                    const RunContext& context, const PassProgress& progress, Volume& volume,
                    Acceleration* acceleration, PassMemory* memory) {
  PassReport report;
  const LatticeStack stack(volume);
  PassMemory own_memory;
  PassMemory& used = memory ? *memory : own_memory;
  CollectedColors& colors = used.colors(volume.slot_count(), nodes.size(), options.kept_color_bytes);
  Totals& totals = colors.totals;

  auto start = Clock::now();
  report.color = collect_color(stack, nodes, options, context, progress, colors, &used);
  report.color_seconds = seconds_since(start);
  report.color_march_cpu_seconds = colors.march_cpu_seconds;

  start = Clock::now();
  totals.clear_opacity();
  const int workers = worker_count(options, context);
  std::vector<double> march_seconds(workers, 0.0);
  report.opacity = sum(for_each_node(nodes, workers, context, progress, 0.3, 1, [&](int node, int worker) {
    NodeScratch& scratch = used.scratch(worker, stack, volume.tau);
    const SampleNode views = resident(nodes[node]);
    compare_with_others(stack, views, node, options, colors, context, scratch);
    const double march_start = thread_seconds();
    const PassCounts counts = march_opacity(stack, views, options.opacity, context, scratch);
    march_seconds[worker] += thread_seconds() - march_start;
    totals.add_opacity(stack, scratch);
    return counts;
  }));
  report.opacity_seconds = seconds_since(start);
  report.opacity_march_cpu_seconds = std::accumulate(march_seconds.begin(), march_seconds.end(), 0.0);

  const std::vector<float> field = prior_opacity_field(volume, options.prior, context.thread_count());
  report.prior_log_likelihood = log_prior(volume, field, options.prior.strength);
  report.update = update_opacity(options.opacity.rule, totals, field, options.prior.strength,
                                 context.thread_count(), volume, acceleration);
  update_color(totals.color, context.thread_count(), volume);
  return report;
}

}  // namespace roxel

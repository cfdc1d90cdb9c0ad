#include "roxel/infer/run_pass.h"

#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numeric>

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

/// Workers' scratch memory, made when a worker first needs it.
class ScratchPool {
 public:
  ScratchPool(const LatticeStack& stack, const std::vector<float>& tau, int workers)
      : stack_(stack), tau_(tau), scratch_(workers) {}
  NodeScratch& of(int worker) {
    if (!scratch_[worker]) scratch_[worker] = std::make_unique<NodeScratch>(stack_, tau_);
    scratch_[worker]->reset();
    return *scratch_[worker];
  }

 private:
  const LatticeStack& stack_;
  const std::vector<float>& tau_;
  std::vector<std::unique_ptr<NodeScratch>> scratch_;
};

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
std::vector<PassCounts> for_each_node(const std::vector<SampleNode>& nodes, const RunContext& context,
                                      const PassProgress& progress, double from, double to,
                                      const Work& work) {
  const std::vector<int> order = by_size(nodes);
  std::vector<PassCounts> counts(nodes.size());
  std::atomic<int> done{0};
  parallel_for(nodes.size(), context.thread_count(), [&](std::int64_t i, int worker) {
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
                         CollectedColors& colors) {
  colors.totals.clear_color();
  ScratchPool pool(stack, stack.volume().tau, context.thread_count());
  const PassCounts counts = sum(for_each_node(nodes, context, progress, 0, 0.3, [&](int node, int worker) {
    NodeScratch& scratch = pool.of(worker);
    const PassCounts node_counts =
        march_color(stack, nodes[node], options.opacity, options.everywhere, context, scratch);
    OwnColors own;
    const bool keep = options.predictive && colors.kept.has_room();
    colors.totals.add_color(stack, scratch, keep ? &own : nullptr);
    if (keep) colors.kept.keep(node, std::move(own));
    return node_counts;
  }));
  colors.of_totals = colors_of(colors.totals.color, context.thread_count());
  return counts;
}

void compare_with_others(const LatticeStack& stack, const std::vector<SampleNode>& nodes, std::size_t node,
                         const PassOptions& options, const CollectedColors& colors, const RunContext& context,
                         NodeScratch& scratch) {
  const OwnColors* own = options.predictive ? colors.kept.of(node) : nullptr;
  if (own) return scratch.compare_with(colors.totals.color, &colors.of_totals, *own);
  if (options.predictive)
    march_color(stack, nodes[node], options.opacity, options.everywhere, context, scratch);
  scratch.compare_with(colors.totals.color, &colors.of_totals);
}

KeptColors::KeptColors(std::size_t node_count, std::size_t limit_bytes)
    : left_bytes_(static_cast<std::int64_t>(limit_bytes)), nodes_(node_count) {}

void KeptColors::keep(std::size_t node, OwnColors own) {
  const std::int64_t bytes = static_cast<std::int64_t>(own.bytes());
  if (left_bytes_.fetch_sub(bytes) < bytes) {
    left_bytes_ += bytes;
    return;
  }
  nodes_[node] = std::make_unique<OwnColors>(std::move(own));
}

PassReport run_pass(const std::vector<SampleNode>& nodes, const PassOptions& options,
                    const RunContext& context, const PassProgress& progress, Volume& volume,
                    Acceleration* acceleration) {
  PassReport report;
  const LatticeStack stack(volume);
  CollectedColors colors(volume.slot_count(), nodes.size(), options.kept_color_bytes);
  Totals& totals = colors.totals;

  auto start = Clock::now();
  report.color = collect_color(stack, nodes, options, context, progress, colors);
  report.color_seconds = seconds_since(start);

  start = Clock::now();
  ScratchPool pool(stack, volume.tau, context.thread_count());
  std::vector<double> march_seconds(context.thread_count(), 0.0);
  report.opacity = sum(for_each_node(nodes, context, progress, 0.3, 1, [&](int node, int worker) {
    NodeScratch& scratch = pool.of(worker);
    compare_with_others(stack, nodes, node, options, colors, context, scratch);
    const double march_start = thread_seconds();
    const PassCounts counts = march_opacity(stack, nodes[node], options.opacity, context, scratch);
    march_seconds[worker] += thread_seconds() - march_start;
    totals.add_opacity(stack, scratch);
    return counts;
  }));
  report.opacity_seconds = seconds_since(start);
  for (const double seconds : march_seconds) report.opacity_march_cpu_seconds += seconds;

  const std::vector<float> field = prior_opacity_field(volume, options.prior, context.thread_count());
  report.prior_log_likelihood = log_prior(volume, field, options.prior.strength);
  report.update = update_opacity(options.opacity.rule, totals, field, options.prior.strength,
                                 context.thread_count(), volume, acceleration);
  update_color(colors.of_totals, context.thread_count(), volume);
  return report;
}

}  // namespace roxel

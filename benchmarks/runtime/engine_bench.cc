/// What a step of a ray costs, beside the same pass written plainly and beside what the machine can do; what
/// a second thread gains; and what large scenes cost. All on synthetic volumes.
///
///     engine_bench [--voxels N] [Google Benchmark's options]
///
/// --voxels: live voxels of the large scene, 10^7 unless given; 0: none. Times of marches are processor time
/// of one thread, the least of several. Fails where fast and plain pass differ by more than rounding
/// explains.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <thread>

#include "engine_worlds.h"
#include "large_scene.h"
#include "machine_roofs.h"
#include "processor_time.h"
#include "roxel/march/brick_lists.h"
#include "scalar_pass.h"

namespace {

using namespace roxel;

constexpr Occupancy kOccupancies[] = {Occupancy::kFull, Occupancy::kHalf, Occupancy::kShell,
                                      Occupancy::kSheet};
/// Neighbouring rays as samples are planned, and so far apart that hardly two meet a voxel, or a brick, both.
constexpr double kSpacings[] = {1, 8};

/// A volume, views of it, and what their rays are compared with.
struct World {
  World(Occupancy occupancy, double spacing)
      : volume(make_volume(occupancy)),
        nodes(make_nodes(volume, {static_cast<int>(4 * spacing), spacing})),
        stack(volume),
        colors(volume.slot_count(), nodes.size(), options.kept_color_bytes),
        plain(volume) {
    collect_color(stack, nodes, options, context, nullptr, colors);
    for (const ColorTotals& totals : colors.totals.color) of_all.push_back(color_of(totals));
    meets = plain.meets(nodes[0]);
  }
  /// The one that is measured next.
  const SampleNode& node(int which) const { return nodes[which % nodes.size()]; }

  PassOptions options;
  RunContext context{1};
  Volume volume;
  std::vector<SampleNode> nodes;
  LatticeStack stack;
  CollectedColors colors;
  std::vector<VoxelColor> of_all;
  ScalarPass plain;
  ScalarPass::Meets meets;  ///< what the first view's rays meet
};

World& world(Occupancy occupancy, double spacing) {
  static std::map<std::pair<Occupancy, double>, std::unique_ptr<World>> worlds;
  std::unique_ptr<World>& made = worlds[{occupancy, spacing}];
  if (!made) made = std::make_unique<World>(occupancy, spacing);
  return *made;
}

/// Of each benchmark, the least of its repetitions: nanoseconds a step, a line or a byte.
std::map<std::string, double>& least_ns() {
  static std::map<std::string, double> least;
  return least;
}

/// Keeps what the tables are made from; they are printed once all is measured.
class LeastReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      const auto ns = run.counters.find("ns");
      if (run.run_type != Run::RT_Iteration || ns == run.counters.end()) continue;
      const auto [entry, fresh] = least_ns().try_emplace(run.run_name.function_name, ns->second.value);
      if (!fresh) entry->second = std::min(entry->second, ns->second.value);
    }
  }
};

/// Times work(), which says how many steps it took, in processor time; prepare() does not count.
template <class Prepare, class Work>
void measure(benchmark::State& state, const Prepare& prepare, const Work& work) {
  double seconds = 0;
  std::int64_t steps = 0;
  for (auto _ : state) {
    prepare();
    const double start = processor_seconds();
    steps += work();
    const double taken = processor_seconds() - start;
    state.SetIterationTime(taken);
    seconds += taken;
  }
  state.counters["ns"] = 1e9 * seconds / static_cast<double>(steps);
}

/// A scratch in which all voxels are set up, as the plain pass has them.
void set_up_all(const World& w, NodeScratch& scratch) {
  for (std::uint32_t brick = 0; brick < w.stack.brick_count(); ++brick) scratch.enter(brick);
}

void fast_color(benchmark::State& state, World& w) {
  NodeScratch scratch(w.stack, w.volume.tau);
  int n = 0;
  measure(
      state, [&] { scratch.reset(), set_up_all(w, scratch); },
      [&] { return march_color(w.stack, w.node(n++), w.options.opacity, false, w.context, scratch).steps; });
}

void fast_opacity(benchmark::State& state, World& w) {
  NodeScratch scratch(w.stack, w.volume.tau);
  int n = 0;
  measure(
      state,
      [&] {
        scratch.reset();
        compare_with_others(w.stack, w.node(n), n % w.nodes.size(), w.options, w.colors, w.context, scratch);
        set_up_all(w, scratch);
      },
      [&] { return march_opacity(w.stack, w.node(n++), w.options.opacity, w.context, scratch).steps; });
}

void plain_color(benchmark::State& state, World& w) {
  int n = 0;
  measure(
      state, [&] { w.plain.begin_color(); },
      [&] { return w.plain.march_color(w.node(n++), w.options.opacity).steps; });
}

void plain_opacity(benchmark::State& state, World& w) {
  int n = 0;
  measure(
      state, [&] { w.plain.begin_opacity(w.of_all); },
      [&] { return w.plain.march_opacity(w.node(n++), w.options.opacity).steps; });
}

/// What comes once a view, whatever its rays: lists of bricks, and voxels set up. A step of such a view.
void once_a_view(benchmark::State& state, World& w) {
  NodeScratch scratch(w.stack, w.volume.tau);
  set_up_all(w, scratch);
  w.plain.begin_color();
  const std::int64_t steps = w.plain.march_color(w.node(0), w.options.opacity).steps;
  measure(
      state, [&] { scratch.reset(); },
      [&] {
        for (const SampleView& view : w.node(0))
          benchmark::DoNotOptimize(BrickLists(w.stack, view.camera, view.plan));
        set_up_all(w, scratch);
        return steps;
      });
}

void stream(benchmark::State& state, Lines& lines) {
  measure(
      state, [] {}, [&] { return lines.stream(), lines.count(); });
}

void gather(benchmark::State& state, Lines& lines) {
  measure(
      state, [] {}, [&] { return lines.gather(1 << 20), std::int64_t{1 << 20}; });
}

std::string name_of(const char* engine, const char* pass, Occupancy occupancy, double spacing) {
  return std::string(engine) + "/" + pass + "/" + name_of(occupancy) +
         (spacing > 1 ? "/apart" : "/side_by_side");
}

using Measured = void (*)(benchmark::State&, World&);

void add_march(const char* engine, const char* pass, Occupancy occupancy, double spacing, Measured measured) {
  benchmark::RegisterBenchmark(name_of(engine, pass, occupancy, spacing).c_str(),
                               [=](benchmark::State& state) { measured(state, world(occupancy, spacing)); })
      ->UseManualTime()
      ->Unit(benchmark::kMillisecond)
      ->MinTime(0.2)
      ->Repetitions(3);
}

void add_benchmarks(Lines& lines) {
  for (const double spacing : kSpacings)
    for (const Occupancy occupancy : kOccupancies) {
      add_march("fast", "color", occupancy, spacing, fast_color);
      add_march("fast", "opacity", occupancy, spacing, fast_opacity);
      add_march("plain", "color", occupancy, spacing, plain_color);
      add_march("plain", "opacity", occupancy, spacing, plain_opacity);
      add_march("fast", "once", occupancy, spacing, once_a_view);
    }
  const auto add_roof = [&](const char* name, void (*roof)(benchmark::State&, Lines&)) {
    benchmark::RegisterBenchmark(name, [&lines, roof](benchmark::State& state) { roof(state, lines); })
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond)
        ->MinTime(0.2)
        ->Repetitions(3);
  };
  add_roof("stream", stream);
  add_roof("gather", gather);
}

bool measured(const std::string& name) { return least_ns().count(name) > 0; }

void print_marches() {
  std::printf("\nWhat rays meet: steps and bricks a ray\n");
  for (const Occupancy occupancy : kOccupancies) {
    const World& w = world(occupancy, 1);
    std::printf("%-8s %9u voxels %8.1f %8.1f\n", name_of(occupancy), w.volume.slot_count(), w.meets.steps,
                w.meets.bricks);
  }
  std::printf(
      "\nNanoseconds a step of processor time, one thread\n%-8s %-8s %-14s %8s %8s %8s %8s %12s %16s %16s\n",
      "pass", "bricks", "rays", "fast", "view", "plain", "ratio", "lines/step", "of the stream",
      "of the gather");
  if (!measured("stream") || !measured("gather")) return;
  const double stream_line = least_ns()["stream"], gather_line = least_ns()["gather"];
  for (const char* pass : {"color", "opacity"})
    for (const Occupancy occupancy : kOccupancies)
      for (const double spacing : kSpacings) {
        const std::string fast = name_of("fast", pass, occupancy, spacing);
        const std::string plain = name_of("plain", pass, occupancy, spacing);
        if (!measured(fast) || !measured(plain)) continue;
        World& w = world(occupancy, spacing);
        const double lines = w.meets.voxels_of_square;
        std::printf("%-8s %-8s %-14s %8.1f %8.1f %8.1f %8.2f %12.3f %14.1f %% %14.1f %%\n", pass,
                    name_of(occupancy), spacing > 1 ? "8 voxels apart" : "side by side", least_ns()[fast],
                    least_ns()[name_of("fast", "once", occupancy, spacing)], least_ns()[plain],
                    least_ns()[plain] / least_ns()[fast], lines, 100 * lines * stream_line / least_ns()[fast],
                    100 * lines * gather_line / least_ns()[fast]);
      }
  std::printf(
      "The machine: %.1f GB/s of stream (64-byte lines read and written back), %.0f million lines a second "
      "of gather.\nlines/step: those that the rays of a square of 8 x 8 move at the least, once each, a step "
      "of theirs.\n"
      "view: what comes once a view, lists of bricks and voxels set up, a step of such a view; of it only "
      "the "
      "lists are in the figures before.\n",
      128 / stream_line, 1e3 / gather_line);
}

/// Largest and mean difference of what both say of a voxel, relative to the value and 1: as the prior is one
/// observation, less than that matters little.
struct Difference {
  double largest = 0, sum = 0;
  std::int64_t count = 0;

  void add(double fast, double plain) {
    const double difference = std::abs(fast - plain) / (std::abs(plain) + 1);
    largest = std::max(largest, difference);
    sum += difference;
    ++count;
  }
  double mean() const { return sum / static_cast<double>(count); }
};

/// Voxels of little colour differ most: fixed point rounds its weight, and a variance is the small difference
/// of large moments.
constexpr double kLargestDifference = 5e-3, kMeanDifference = 1e-5, kLikelihoodDifference = 1e-6;

bool same_pass(Occupancy occupancy, bool predictive) {
  const World& w = world(occupancy, 1);
  PassOptions options;
  options.predictive = predictive;
  options.prior.spatial_lambda = 0;
  Volume volume = w.volume;
  const PassReport report = run_pass(w.nodes, options, w.context, nullptr, volume);
  const ScalarPass::Result plain = ScalarPass(w.volume).run(w.nodes, options);
  Difference hits, exposure, tau;
  for (std::uint32_t slot = 0; slot < volume.slot_count(); ++slot) {
    hits.add(volume.support[slot][0], plain.hits[slot]);
    exposure.add(volume.support[slot][1], plain.exposure[slot]);
    tau.add(volume.tau[slot], plain.tau[slot]);
  }
  const double fast_mean = report.opacity.log_likelihood / report.opacity.observation_weight;
  const double plain_mean = plain.opacity.log_likelihood / plain.opacity.observation_weight;
  const double likelihood = std::abs(fast_mean - plain_mean) / std::abs(plain_mean);
  std::printf("%-8s %-12s %10.1e %10.1e %10.1e %10.1e %10.1e %10.1e %14.1e\n", name_of(occupancy),
              predictive ? "the others" : "all", hits.largest, hits.mean(), exposure.largest, exposure.mean(),
              tau.largest, tau.mean(), likelihood);
  return std::max({hits.largest, exposure.largest, tau.largest}) <= kLargestDifference &&
         std::max({hits.mean(), exposure.mean(), tau.mean()}) <= kMeanDifference &&
         likelihood <= kLikelihoodDifference;
}

bool same_passes() {
  std::printf(
      "\nRelative difference of a fast and a plain pass: largest and mean over voxels\n%-8s %-12s %21s %21s "
      "%21s %14s\n",
      "bricks", "compared with", "hits", "exposure", "tau", "log-likelihood");
  bool same = true;
  for (const Occupancy occupancy : kOccupancies)
    for (const bool predictive : {false, true}) same &= same_pass(occupancy, predictive);
  std::printf("bounds: %.0e, %.0e, log-likelihood %.0e: %s\n", kLargestDifference, kMeanDifference,
              kLikelihoodDifference, same ? "kept" : "EXCEEDED");
  return same;
}

double seconds_of_pass(const World& w, int threads, Volume& volume, PassMemory& memory) {
  volume.tau = w.volume.tau;
  const auto start = std::chrono::steady_clock::now();
  run_pass(w.nodes, w.options, RunContext(threads), nullptr, volume, nullptr, &memory);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void print_threads(int threads) {
  if (threads < 2) return;
  std::printf("\nThreads: wall time of a whole pass, the least of five\n%-10s %10s %9dt %10s\n", "bricks",
              "1 thread", threads, "speed-up");
  double registers[2] = {1e30, 1e30};
  for (const Occupancy occupancy : {Occupancy::kFull, Occupancy::kShell}) {
    const World w(occupancy, 1);
    Volume volume = w.volume;
    PassMemory memory;
    double seconds[2] = {1e30, 1e30};
    seconds_of_pass(w, threads, volume, memory);
    for (int turn = 0; turn < 5; ++turn)
      for (const bool all : {false, true}) {
        const int n = all ? threads : 1;
        seconds[all] = std::min(seconds[all], seconds_of_pass(w, n, volume, memory));
        registers[all] = std::min(registers[all], register_loop_seconds(n));
      }
    std::printf("%-10s %10.3f %10.3f %10.2f\n", name_of(occupancy), seconds[0], seconds[1],
                seconds[0] / seconds[1]);
  }
  std::printf("%-10s %10.3f %10.3f %10.2f\n", "registers", registers[0], registers[1],
              threads * registers[0] / registers[1]);
}

/// Takes "--voxels N" out of the arguments.
std::int64_t voxels_asked_for(int& argc, char** argv) {
  std::int64_t voxels = 10'000'000;
  int kept = 1;
  for (int i = 1; i < argc; ++i)
    if (std::strcmp(argv[i], "--voxels") == 0 && i + 1 < argc) {
      voxels = static_cast<std::int64_t>(std::atof(argv[++i]));
    } else {
      argv[kept++] = argv[i];
    }
  argc = kept;
  return voxels;
}

}  // namespace

int main(int argc, char** argv) {
  const std::int64_t voxels = voxels_asked_for(argc, argv);
  const int threads = std::min(2u, std::max(1u, std::thread::hardware_concurrency()));
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  if (voxels > 0) large_scene(voxels, threads);  // first, while the process holds nothing else

  Lines lines(1 << 20);  // a line a voxel, as in a pass's scratch
  add_benchmarks(lines);
  LeastReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  print_marches();
  const bool same = same_passes();
  print_threads(threads);
  return same ? 0 : 1;
}

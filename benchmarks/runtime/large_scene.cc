#include "large_scene.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <optional>
#include <string>

#include "engine_worlds.h"
#include "roxel/base/peak_memory.h"
#include "roxel/volume/refine.h"

namespace roxel {
namespace {

constexpr double kGiB = 1 << 30;
/// What is asked for before something is begun, in bytes a live voxel: what runs of this benchmark took, and
/// a little more.
constexpr double kBytesOfVolume = 62, kBytesOfTwoVolumes = 106;
constexpr double kBytesOfPass = 120;   ///< beside the volume and scratch
constexpr double kSpare = 1.5 * kGiB;  ///< that passes leave to lists of bricks and to other programs

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Memory that the process holds now; what was freed is given back first.
double resident_bytes() {
  malloc_trim(0);
  std::ifstream in("/proc/self/statm");
  double pages = 0, resident = 0;
  in >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

double free_bytes() {
  std::ifstream in("/proc/meminfo");
  for (std::string name; in >> name;)
    if (double kib = 0; name == "MemAvailable:" && in >> kib) return 1024 * kib;
  return 0;
}

bool fits(const char* what, double bytes) {
  if (bytes < free_bytes()) return true;
  std::printf("%-34s left out: takes about %.1f GiB, %.1f are free\n", what, bytes / kGiB,
              free_bytes() / kGiB);
  return false;
}

/// Runs `work(threads)` with one thread and with all, and prints a line. What `prepare` does does not count.
template <class Prepare, class Work>
void row(const char* what, int threads, const Prepare& prepare, const Work& work) {
  PeakMemory peak;
  double seconds[2] = {0, 0};
  for (const bool all : {false, true}) {
    if (all && threads == 1) continue;
    prepare();
    seconds[all] = seconds_of([&] { work(all ? threads : 1); });
  }
  std::printf("%-34s %8.2f", what, seconds[0]);
  if (threads > 1) std::printf(" %8.2f %9.2f", seconds[1], seconds[0] / seconds[1]);
  std::printf(" %12.2f\n", static_cast<double>(peak.bytes()) / kGiB);
  std::fflush(stdout);
}

/// A gyroid that goes four times through its box, `thickness` voxels thick, holds about 12.4 side^2 thickness
/// voxels; after dilation by one, three more layers; after division, eight times as many.
int parent_side_in_bricks(std::int64_t voxels, double thickness) {
  const double side = std::sqrt(static_cast<double>(voxels) / (8 * 12.4 * (thickness + 3.1)));
  return std::max(2, static_cast<int>(std::lround(side / kBrickSide)));
}

std::vector<SampleNode> few_small_views(const Volume& volume) {
  ViewOptions options;
  options.count = 4;
  options.most_samples = 256;
  return make_nodes(volume, options);
}

/// Two passes: the first takes its memory from the system, the second finds it there. As a run does, on as
/// many threads, and with as many colours kept, as there is memory for.
void measure_passes(int threads, Volume& volume, double before) {
  const double live = volume.slot_count();
  const std::vector<SampleNode> nodes = few_small_views(volume);
  PassOptions options;
  const double room = free_bytes() - kBytesOfPass * live - kSpare;
  options.most_workers =
      std::clamp(static_cast<int>(room / (static_cast<double>(sizeof(VoxelScratch)) * live)), 1, threads);
  const double scratch = static_cast<double>(sizeof(VoxelScratch)) * live * options.most_workers;
  options.kept_color_bytes = static_cast<std::size_t>(
      std::clamp(room - scratch, 0.0, static_cast<double>(options.kept_color_bytes)));
  PeakMemory peak;
  PassMemory memory;
  for (const char* which : {"first", "second"}) {
    PassReport report;
    const double seconds = seconds_of(
        [&] { report = run_pass(nodes, options, RunContext(threads), nullptr, volume, nullptr, &memory); });
    std::printf("%s pass, %zu views, %.2g steps, %d workers: %.2f s (colours %.2f, opacities %.2f)\n", which,
                nodes.size(), static_cast<double>(report.opacity.steps), options.most_workers, seconds,
                report.color_seconds, report.opacity_seconds);
  }
  const double most = static_cast<double>(peak.bytes());
  memory.release();
  std::printf("resident: %.1f bytes a live voxel between passes, %.1f at the most within one\n",
              (resident_bytes() - before) / live, (most - before) / live);
}

}  // namespace

void large_scene(std::int64_t voxels, int threads) {
  if (!fits("large scene", kBytesOfVolume * static_cast<double>(voxels))) return;
  const double before = resident_bytes();
  constexpr double kThickness = 1.5;
  const int side = parent_side_in_bricks(voxels, kThickness);
  const LatticeFrame frame{{0, 0, 0}, 1, Eigen::Vector3i::Constant(side)};
  std::vector<BrickVoxels> bricks = gyroid_bricks(side, 4, kThickness, threads);

  std::printf("\nLarge scene (seconds of wall time)\n%-34s %8s", "", "1 thread");
  if (threads > 1) std::printf(" %7dt %9s", threads, "speed-up");
  std::printf(" %12s\n", "peak, GiB");
  const auto nothing = [] {};
  std::optional<Topology> topology, half, child;
  row(
      "insert the coarser volume's bricks", threads, [&] { topology.emplace(frame); },
      [&](int t) { topology->insert_bricks(bricks, t); });
  bricks = {};
  const Eigen::AlignedBox3d inner(frame.box().center() - 0.25 * frame.box().sizes(),
                                  frame.box().center() + 0.25 * frame.box().sizes());
  row(
      "erase the voxels in an inner box", threads, [&] { half = topology; },
      [&](int t) { half->erase_inside(inner, t); });
  half.reset();
  row(
      "dilate by one voxel", threads, [&] { half = topology; }, [&](int t) { half->dilate(1, t); });
  topology = std::move(half);
  row(
      "divide each voxel into eight", threads, [&] { child.reset(); },
      [&](int t) { child = topology->subdivided(t); });
  topology.reset();
  const std::int64_t live = child->voxel_count();
  std::optional<BrickIndex> index;
  row(
      "number the voxels (index)", threads, [&] { index.reset(); },
      [&](int t) { index.emplace(*child, 0, t); });
  const std::size_t brick_count = index->bricks().size();
  index.reset();
  std::optional<Volume> volume;
  row(
      "make the volume: index, channels", threads, [&] { volume.reset(); },
      [&](int t) { volume.emplace(std::vector<Topology>{*child}, t); });
  child.reset();
  std::printf("%.3g live voxels, %zu bricks of %.0f, box of %d voxels a side\n", static_cast<double>(live),
              brick_count, static_cast<double>(live) / static_cast<double>(brick_count),
              2 * side * kBrickSide);
  std::fill(volume->tau.begin(), volume->tau.end(), tau_from_alpha(0.02f));
  std::printf("resident: %.1f bytes a live voxel before the first pass\n",
              (resident_bytes() - before) / static_cast<double>(live));
  std::fflush(stdout);

  if (fits("passes", (kBytesOfPass + sizeof(VoxelScratch)) * static_cast<double>(live)))
    measure_passes(threads, *volume, before);
  if (fits("prune", (kBytesOfTwoVolumes - kBytesOfVolume) * static_cast<double>(live))) {
    // Every second stretch of 64 voxels goes.
    for (std::uint32_t slot = 0; slot < volume->slot_count(); ++slot)
      volume->tau[slot] = slot / 64 % 2 == 0 ? 0.5f : 0.01f;
    RefineOptions prune;
    prune.opacity_threshold = 0.1f;
    prune.subdivide = false;
    std::optional<Volume> pruned;
    row("prune, dilate by one, channels", threads, nothing, [&](int t) {
      pruned.reset();
      pruned = refine(*volume, prune, t);
    });
    std::printf("%.3g voxels behind it\n", static_cast<double>(pruned->slot_count()));
  }
}

}  // namespace roxel

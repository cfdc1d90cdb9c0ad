// The model. A level's voxels: at first, the cells of its lattices that some view sees. Later, sheets around
// surfaces and what has not been carved yet: on real scenes about 22 layers of the box's mean cross-section,
// at any resolution. Rays cross as many of them as lie behind each other, times a share. Everything else is
// counting bytes and nanoseconds.
#include "roxel/solve/estimate.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/error.h"
#include "roxel/base/formatted.h"
#include "roxel/image/sample_pyramid.h"
#include "roxel/infer/run_pass.h"
#include "roxel/march/sample_plan.h"
#include "roxel/solve/gains.h"

namespace roxel {
namespace {

// Measured on plane, head, templeSparseRing and dtu-scan24 (with and without masks), at 64 to 256 voxels.
constexpr double kSheetLayers = 22;
constexpr double kInsideFactor = 4;  ///< times that, around cameras that stand in the box (courtyard)
constexpr double kFogFactor = 2.3;   ///< times that, where there is a surround (dtu-scan24 without masks)
constexpr double kCrossedShare = 0.5;
constexpr double kFilledShare = 0.9;         ///< of the box's cells, at most
constexpr double kFirstSurroundShare = 0.3;  ///< of a surround lattice's cells, in the first level
constexpr double kSurroundShare = 0.6;       ///< of the box's voxels, for each surround lattice (a room)
constexpr double kSurroundSteps = 4;         ///< more steps a ray for each surround lattice
constexpr double kRaysPerSample = 1.15;      ///< finest samples, and the coarser ones they come from

// Nanoseconds on one core: a ray-voxel step of the colour and the opacity march, loading a pixel.
constexpr double kColorStepNs = 24;  // with what is done once a voxel and node
constexpr double kOpacityStepNs = 34;
constexpr double kLoadPixelNs = 60;
constexpr double kDraftCost = 0.45;  ///< of a pass on all samples

// Bytes a voxel: channels of the volume, totals of a pass, and a worker's scratch.
constexpr double kChannelBytes = 4 + 4 + 4 + 12 + 12 + 8 + 12;
constexpr double kTotalsBytes = 80 + 24 + 8;
constexpr double kScratchBytes = 64;
constexpr double kKeptShare = 0.6;  ///< of the voxels, for each node
constexpr double kVoxelsPerBrick = 150;
constexpr double kWritingBytesPerBrick = 36 * 1024;
/// Of BrickLists while they are made: outlines, and a dozen squares of samples that a brick is seen in.
constexpr double kListedBytesPerBrick = 250;
constexpr double kGiB = 1024.0 * 1024 * 1024;
constexpr double kProgramBytes = 200e6;  ///< libraries
constexpr double kMemoryMargin = 1.15;   ///< rather too much than too little
constexpr double kDecodedBytesPerPixel = 40;
constexpr double kResultBytesPerPixel = 120;  ///< depth map, rendering, pictures

double pixel_count(const View& view) {
  return static_cast<double>(view.camera.intrinsics.width) * view.camera.intrinsics.height;
}

/// What the images of a level amount to.
struct SampleLoad {
  double rays = 0;
  double bytes = 0;         ///< of all samples
  double largest_node = 0;  ///< bytes of those of the node that has most
};

SampleLoad sample_load(const Dataset& dataset, const Scene& scene, double voxel_size,
                       const ReconstructOptions& options) {
  SampleLoad load;
  std::vector<double> of_nodes(dataset.nodes.size(), 0.0);
  SamplePlanOptions plan_options;
  plan_options.samples_per_voxel = options.samples_per_voxel;
  plan_options.adaptive = options.adaptive;
  for (std::size_t v = 0; v < dataset.views.size(); ++v) {
    const View& view = dataset.views[v];
    const SamplePlan plan = make_sample_plan(view.camera, scene.bounds.box, voxel_size,
                                             view_range(scene, dataset, static_cast<int>(v)), plan_options);
    load.rays += kRaysPerSample * pixel_count(view) * std::ldexp(1.0, -2 * plan.finest_level);
    const double bytes = pyramid_bytes(pixel_count(view), plan.finest_level);
    load.bytes += bytes;
    of_nodes[view.node_idx] += bytes;
  }
  for (const double bytes : of_nodes) load.largest_node = std::max(load.largest_node, bytes);
  return load;
}

/// Voxels that a ray crosses in the box, and how many there are.
struct BoxVoxels {
  double count = 0;
  double crossed = 0;
};

BoxVoxels box_voxels(const Eigen::Vector3d& cells, bool first_level, double layers) {
  const double all = cells.prod();
  const double mean_side = cells.mean();
  const double cross_section = (cells.x() * cells.y() + cells.y() * cells.z() + cells.z() * cells.x()) / 3;
  if (first_level) return {all, kCrossedShare * mean_side};
  const double count = std::min(kFilledShare * all, cross_section * layers);
  return {count, kCrossedShare * std::min(layers, mean_side)};
}

LevelEstimate estimate_level(const Scene& scene, double voxel_size, bool first_level, double rays,
                             double layers) {
  const Eigen::Vector3d cells =
      nested_frames(scene.bounds.box, voxel_size, scene.surround_count)[0].size_in_voxels().cast<double>();
  const Eigen::Vector3d used = first_level ? cells : Eigen::Vector3d(scene.bounds.box.sizes() / voxel_size);
  const BoxVoxels box = box_voxels(used, first_level, layers);
  LevelEstimate level;
  level.voxel_size = voxel_size;
  const double per_lattice =
      first_level ? kFirstSurroundShare * cells.prod() * 7 / 8 : kSurroundShare * box.count;
  level.voxels = box.count + scene.surround_count * per_lattice;
  level.steps_per_pass = rays * (box.crossed + kSurroundSteps * scene.surround_count);
  return level;
}

/// What a level needs beside what may be shared out, and what it would take of that.
struct LevelNeeds {
  double needed = 0;     ///< without any samples that stay, or kept colours
  double samples = 0;    ///< to keep all
  double in_flight = 0;  ///< more, where not all samples stay: one node a worker
  double colors = 0;     ///< to keep those of all nodes
};

LevelNeeds level_needs(const LevelEstimate& level, const SampleLoad& load, double largest_image, int nodes,
                       int threads, int workers) {
  const double bricks = level.voxels / kVoxelsPerBrick;
  const double volume = level.voxels * kChannelBytes + bricks * sizeof(Brick);
  // Checkpoints are written, and last of all depth is made, beside what passes work in.
  const double passing =
      level.voxels * (kTotalsBytes + kScratchBytes * workers) + workers * bricks * kListedBytesPerBrick +
      std::max(threads * largest_image * kResultBytesPerPixel, bricks * kWritingBytesPerBrick);
  const double loading = threads * largest_image * kDecodedBytesPerPixel;
  LevelNeeds needs;
  needs.needed = kProgramBytes + volume + std::max(passing, loading);
  needs.samples = load.bytes;
  needs.in_flight = workers * (load.largest_node + largest_image * kDecodedBytesPerPixel);
  needs.colors = kKeptShare * nodes * level.voxels * sizeof(OwnColors::Entry);
  return needs;
}

double largest_image_of(const Dataset& dataset) {
  double largest = 0;
  for (const View& view : dataset.views) largest = std::max(largest, pixel_count(view));
  return largest;
}

double layers_of(const Scene& scene) {
  const double fog = scene.surround_count > 0 ? kFogFactor : 1;
  return kSheetLayers * (scene.seen_from_inside ? kInsideFactor : fog);
}

double level_voxel_size(const Scene& scene, const ReconstructOptions& options, int level) {
  return std::ldexp(scene.voxel_size, options.levels - 1 - level);
}

std::vector<LevelNeeds> needs_of_levels(const Dataset& dataset, const Scene& scene,
                                        const ReconstructOptions& options, int threads, int workers) {
  std::vector<LevelNeeds> needs;
  for (int level = 0; level < options.levels; ++level) {
    const double voxel_size = level_voxel_size(scene, options, level);
    const SampleLoad load = sample_load(dataset, scene, voxel_size, options);
    needs.push_back(level_needs(estimate_level(scene, voxel_size, level == 0, load.rays, layers_of(scene)),
                                load, largest_image_of(dataset), static_cast<int>(dataset.nodes.size()),
                                threads, workers));
    if (options.illumination != IlluminationChoice::kNone)
      needs.back().needed += SmallPhotographs::bytes(dataset);
  }
  return needs;
}

/// The finest voxel size that keeps to the limit, where `scene`'s does not; 0 where none does.
double voxel_size_that_fits(const Dataset& dataset, Scene scene, const ReconstructOptions& options,
                            int threads) {
  constexpr double kStep = 1.05, kCoarsest = 100;
  for (const double finest = scene.voxel_size; scene.voxel_size < kCoarsest * finest;
       scene.voxel_size *= kStep)
    if (plan_memory(dataset, scene, options, threads).fits) return scene.voxel_size;
  return 0;
}

}  // namespace

double pyramid_bytes(double pixels, int finest_level) {
  constexpr double kRegion = sizeof(RegionStats);
  if (finest_level == 0) return pixels * (14 + kRegion / 3);
  return pixels * std::ldexp(1.0, -2 * finest_level) * kRegion * 4 / 3;
}

MemoryPlan plan_memory(const Dataset& dataset, const Scene& scene, const ReconstructOptions& options,
                       int threads) {
  MemoryPlan plan;
  plan.limit_bytes = options.memory ? *options.memory * kGiB : memory_at_hand();
  std::vector<LevelNeeds> levels;
  for (int workers = threads; workers >= 1; --workers) {
    levels = needs_of_levels(dataset, scene, options, threads, workers);
    if (workers < threads) plan.workers = workers;
    if (std::all_of(levels.begin(), levels.end(), [&](const LevelNeeds& level) {
          return kMemoryMargin * (level.needed + std::min(level.samples, level.in_flight)) <=
                 plan.limit_bytes;
        }))
      break;
  }
  for (const LevelNeeds& level : levels) {
    const double room = plan.limit_bytes / kMemoryMargin - level.needed;
    if (level.samples <= room) continue;
    plan.sample_bytes = std::clamp(room - level.in_flight, 0.0, plan.sample_bytes);
  }
  const auto taken_by_samples = [&](const LevelNeeds& level) {
    return level.samples <= plan.sample_bytes ? level.samples : plan.sample_bytes + level.in_flight;
  };
  double colors = static_cast<double>(plan.kept_color_bytes);
  for (const LevelNeeds& level : levels)
    colors = std::min(
        colors, std::max(0.0, plan.limit_bytes / kMemoryMargin - level.needed - taken_by_samples(level)));
  plan.kept_color_bytes = static_cast<std::int64_t>(colors);
  for (const LevelNeeds& level : levels)
    plan.peak_bytes = std::max(plan.peak_bytes, kMemoryMargin * (level.needed + taken_by_samples(level) +
                                                                 std::min(colors, level.colors)));
  plan.fits = plan.peak_bytes <= plan.limit_bytes * (1 + 1e-9);
  return plan;
}

CostEstimate estimate_cost(const Dataset& dataset, const Scene& scene, const ReconstructOptions& options,
                           int threads) {
  double all_pixels = 0;
  for (const View& view : dataset.views) all_pixels += pixel_count(view);
  CostEstimate cost;
  cost.memory = plan_memory(dataset, scene, options, threads);
  double core_ns = all_pixels * kLoadPixelNs;  // survey
  for (int level = 0; level < options.levels; ++level) {
    const double voxel_size = level_voxel_size(scene, options, level);
    const SampleLoad load = sample_load(dataset, scene, voxel_size, options);
    const LevelEstimate estimate = estimate_level(scene, voxel_size, level == 0, load.rays, layers_of(scene));
    const double colour_marches = options.predictive ? 1.5 : 1;  // most nodes' own colours are kept
    core_ns += all_pixels * kLoadPixelNs;
    const double full_passes =
        most_passes(scene, options, level + 1) - most_drafts(scene, options, level + 1) * (1 - kDraftCost);
    core_ns += full_passes * estimate.steps_per_pass * (colour_marches * kColorStepNs + kOpacityStepNs);
    cost.levels.push_back(estimate);
  }
  // Depth and renders look along the ray of every pixel.
  core_ns += all_pixels * (2 * kLoadPixelNs +
                           cost.levels.back().steps_per_pass /
                               std::max(1.0, sample_load(dataset, scene, scene.voxel_size, options).rays) *
                               (kColorStepNs + kOpacityStepNs));
  cost.seconds = 1e-9 * core_ns / std::min(threads, cost.memory.workers);
  return cost;
}

std::string memory_shortage(const Dataset& dataset, const Scene& scene, const ReconstructOptions& options,
                            int threads) {
  const MemoryPlan plan = plan_memory(dataset, scene, options, threads);
  const double fits = voxel_size_that_fits(dataset, scene, options, threads);
  const std::string advice = fits > 0 ? formatted("--voxel-size %.4g would fit", fits)
                                      : "no size of voxels would fit; see --images and --bounds";
  return formatted("%.2f GiB where about %.2f GiB are needed for voxels of %.4g; %s", plan.limit_bytes / kGiB,
                   plan.peak_bytes / kGiB, scene.voxel_size, advice.c_str());
}

void require_memory(const Dataset& dataset, const Scene& scene, const ReconstructOptions& options,
                    int threads) {
  if (options.memory && !plan_memory(dataset, scene, options, threads).fits)
    throw InvalidInput("--memory: found " + memory_shortage(dataset, scene, options, threads));
}

}  // namespace roxel

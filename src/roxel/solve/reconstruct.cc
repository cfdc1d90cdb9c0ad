#include "roxel/solve/reconstruct.h"

#include <chrono>
#include <cmath>

#include "roxel/base/error.h"
#include "roxel/infer/touch.h"
#include "roxel/volume/refine.h"

namespace roxel {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Turns levels and passes into one fraction; a finer level is expected to cost four times the one before.
class LevelProgress {
 public:
  LevelProgress(const ReconstructOptions& options, RunContext& context, double share)
      : options_(options), context_(context), share_(share) {
    for (int level = 0; level < options.levels; ++level) total_ += std::pow(kGrowth, level);
  }
  void report(int level, int pass, double fraction_of_pass) {
    double before = 0;
    for (int l = 1; l < level; ++l) before += std::pow(kGrowth, l - 1);
    const double in_level = (pass - 1 + fraction_of_pass) / options_.passes;
    Progress progress{"volume", level, options_.levels, pass, options_.passes, 0};
    progress.fraction = share_ * (before + in_level * std::pow(kGrowth, level - 1)) / total_;
    context_.report(progress);
  }

 private:
  static constexpr double kGrowth = 4;
  const ReconstructOptions& options_;
  RunContext& context_;
  double share_;
  double total_ = 0;
};

PassRecord make_record(int level, int pass, bool draft, const Volume& volume, const PassReport& report,
                       double seconds) {
  PassRecord record;
  record.level = level;
  record.pass = pass;
  record.draft = draft;
  record.active_voxels = volume.slot_count();
  record.rays = report.opacity.rays;
  record.steps = report.opacity.steps;
  record.color_steps = report.color.steps;
  if (report.opacity.observation_weight > 0)
    record.mean_log_likelihood = report.opacity.log_likelihood / report.opacity.observation_weight;
  record.mean_opacity_change = report.update.mean_opacity_change;
  record.mean_opacity = report.update.mean_opacity;
  record.seconds = seconds;
  record.color_seconds = report.color_seconds;
  record.opacity_seconds = report.opacity_seconds;
  if (record.steps > 0) record.ns_per_step = 1e9 * report.opacity_march_cpu_seconds / record.steps;
  return record;
}

Volume first_volume(const Scene& scene, const std::vector<SampleNode>& samples,
                    const ReconstructOptions& options, const RunContext& context, const Volume* initial) {
  Volume volume(reached_voxels(frames_of_first_level(scene, options), samples, context));
  if (volume.box_slot_count() == 0)
    throw_invalid("bounds", "a box and depths in which no ray of any photograph meets a voxel",
                  "a box that photographs show: see --bounds, --near, --far and the warnings of roxel info");
  volume.resize_channels();
  std::fill(volume.tau.begin(), volume.tau.end(), tau_from_alpha(static_cast<float>(options.prior_opacity)));
  if (initial) initialise_from(*initial, volume);
  return volume;
}

RefineOptions refine_options(const ReconstructOptions& options) {
  RefineOptions refine;
  refine.opacity_threshold = static_cast<float>(options.opacity_threshold);
  refine.confidence_threshold = static_cast<float>(options.confidence_threshold);
  refine.prior_opacity = static_cast<float>(options.prior_opacity);
  return refine;
}

/// Before a background that may have any colour, and before a camera inside the box, whatever rises first
/// hides what is behind it: there, only falling opacities are hurried.
Accelerate which_steps(const Scene& scene) {
  const bool open = scene.background.kind == BackgroundKind::kUnknown || scene.seen_from_inside;
  return open ? Accelerate::kFalling : Accelerate::kBoth;
}

/// Passes, the first of them drafts, until the opacities rest or the limit is reached; returns whether they
/// rest. The last pass is never hurried: its opacities follow from its sums alone, which `merge` relies on.
bool run_passes(const std::vector<SampleNode>& samples, const ReconstructOptions& options, int level,
                bool first_ever, const RunContext& context, LevelProgress& progress,
                const ReconstructHooks& hooks, const Scene& scene, Volume& volume, Summary& summary) {
  PassOptions pass_opts = pass_options(scene, options);
  const std::vector<SampleNode> drafts = drafts_of(samples);
  int draft_passes = std::min(options.draft_passes, options.passes - 1);
  Acceleration acceleration(volume.slot_count(), options.acceleration, which_steps(scene));
  bool resting = false;
  for (int pass = 1; pass <= options.passes; ++pass) {
    const auto start = Clock::now();
    const bool draft = pass <= draft_passes;
    const bool last = resting || pass == options.passes;
    pass_opts.everywhere = first_ever && pass == 1;
    const PassReport report = run_pass(
        draft ? drafts : samples, pass_opts, context,
        [&](double fraction) { progress.report(level, pass, fraction); }, volume,
        last ? nullptr : &acceleration);
    summary.passes.push_back(make_record(level, pass, draft, volume, report, seconds_since(start)));
    if (!std::isfinite(report.opacity.log_likelihood))
      throw NumericalError("level " + std::to_string(level) + ", pass " + std::to_string(pass) +
                           ": the log-likelihood is not finite; --noise, --outlier or --uninformative are "
                           "far from what colours are like");
    if (hooks.after_pass) hooks.after_pass(summary.passes.back());
    const bool rests = report.update.mean_opacity_change < options.tolerance;
    if (last) return resting || rests;
    if (options.all_passes || !rests) continue;
    resting = !draft;
    draft_passes = std::min(draft_passes, pass);  // drafts say no more: on to the samples themselves
  }
  return false;
}

}  // namespace

PassOptions pass_options(const Scene& scene, const ReconstructOptions& options) {
  PassOptions pass;
  pass.opacity.rule = options.update;
  pass.opacity.model = scene.model;
  pass.opacity.background = scene.background;
  pass.opacity.filters.rays = options.filter_rays;
  pass.opacity.filters.background = options.filter_background;
  pass.opacity.filters.interpolate = options.interpolate;
  pass.opacity.ray_weights = options.ray_weights;
  pass.prior.opacity = options.prior_opacity;
  pass.prior.strength = options.prior_strength;
  pass.prior.spatial_lambda = options.spatial_prior;
  pass.predictive = options.predictive;
  return pass;
}

void initialise_from(const Volume& initial, Volume& volume) {
  for (int k = 0; k < volume.lattice_count(); ++k) {
    const BrickIndex& index = volume.index(k);
    for (const Brick& brick : index.bricks())
      for (int v = 0; v < kBrickVoxels; ++v) {
        if (brick.local[v] == kNoVoxel) continue;
        const std::uint32_t slot = brick.first_slot + brick.local[v];
        const Eigen::Vector3i ijk = kBrickSide * brick.coord + Eigen::Vector3i(v % 8, v / 8 % 8, v / 64);
        const Eigen::Vector3d centre = index.frame().voxel_centre(ijk);
        for (int source = 0; source < initial.lattice_count(); ++source) {
          const LatticeFrame& frame = initial.index(source).frame();
          const Eigen::Vector3d cell = (centre - frame.origin) / frame.voxel_size;
          const std::uint32_t from = initial.index(source).slot(cell.array().floor().cast<int>().matrix());
          if (from == kNoSlot) continue;
          // Optical depth is per voxel length: it scales with the voxel's size.
          volume.tau[slot] =
              static_cast<float>(initial.tau[from] * index.frame().voxel_size / frame.voxel_size);
          volume.color_mean[slot] = initial.color_mean[from];
          volume.color_cov[slot] = initial.color_cov[from];
          volume.color_weight[slot] = initial.color_weight[from];
          volume.confidence[slot] = initial.confidence[from];
          break;
        }
      }
  }
}

Reconstruction reconstruct(const Dataset& dataset, const PhotographLoader& load,
                           const ReconstructOptions& options, RunContext& context,
                           const ReconstructHooks& hooks, double progress_share) {
  const auto start = Clock::now();
  Reconstruction result;
  Summary& summary = result.summary;
  result.scene = survey(dataset, load, options, context);
  summary.notes = dataset.notes;
  summary.notes.insert(summary.notes.end(), result.scene.notes.begin(), result.scene.notes.end());
  if (hooks.after_survey) hooks.after_survey(result.scene);
  summary.stages.push_back({"survey", seconds_since(start), peak_memory_bytes()});

  LevelProgress progress(options, context, progress_share);
  for (int level = 1; level <= options.levels; ++level) {
    const auto level_start = Clock::now();
    const double voxel_size = std::ldexp(result.scene.voxel_size, options.levels - level);
    const std::vector<SampleNode> samples =
        make_samples(dataset, load, result.scene, voxel_size, options, context);
    result.volume = level == 1 ? first_volume(result.scene, samples, options, context, hooks.initial)
                               : refine(result.volume, refine_options(options), context.thread_count());
    LevelRecord record;
    record.voxel_size = voxel_size;
    record.voxels_in_box = result.volume.box_slot_count();
    record.voxels_around = result.volume.slot_count() - result.volume.box_slot_count();
    const bool first_ever = level == 1 && !hooks.initial;
    record.converged = run_passes(samples, options, level, first_ever, context, progress, hooks, result.scene,
                                  result.volume, summary);
    record.seconds = seconds_since(level_start);
    summary.levels.push_back(record);
    if (hooks.after_level) hooks.after_level(result.volume, result.scene, summary);
  }
  summary.termination = summary.levels.back().converged ? "converged" : "pass limit";
  summary.seconds = seconds_since(start);
  summary.peak_memory_bytes = peak_memory_bytes();
  return result;
}

}  // namespace roxel

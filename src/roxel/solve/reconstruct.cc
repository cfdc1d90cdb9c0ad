#include "roxel/solve/reconstruct.h"

#include <chrono>
#include <cmath>
#include <cstdio>

#include "roxel/base/error.h"
#include "roxel/base/peak_memory.h"
#include "roxel/infer/overlap.h"
#include "roxel/infer/touch.h"
#include "roxel/solve/carve_sky.h"
#include "roxel/solve/fit_colors.h"
#include "roxel/solve/gains.h"
#include "roxel/solve/surface_paint.h"
#include "roxel/volume/refine.h"

namespace roxel {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Turns levels and passes into one fraction; a pass of a finer level is expected to cost four of the one
/// before.
class LevelProgress {
 public:
  LevelProgress(const Scene& scene, const ReconstructOptions& options, RunContext& context, double share)
      : scene_(scene), options_(options), context_(context), share_(share) {
    for (int level = 1; level <= options.levels; ++level) total_ += cost_of(level);
  }
  void report(int level, int pass, double fraction_of_pass) {
    double before = 0;
    for (int l = 1; l < level; ++l) before += cost_of(l);
    const int passes = most_passes(scene_, options_, level);
    const double in_level = (pass - 1 + fraction_of_pass) / passes;
    Progress progress{"volume", level, options_.levels, pass, passes, 0};
    progress.fraction = share_ * passes_share() * (before + in_level * cost_of(level)) / total_;
    context_.report(progress);
  }
  /// Of the fit of colours, which follows the passes.
  void report_colors(double fraction) {
    Progress progress{"colours", 0, 0, 0, 0, share_ * (passes_share() + (1 - passes_share()) * fraction)};
    context_.report(progress);
  }

 private:
  static constexpr double kGrowth = 4;
  double cost_of(int level) const {
    return std::pow(kGrowth, level - 1) * most_passes(scene_, options_, level);
  }
  /// Of the time; the rest is the fit of colours.
  double passes_share() const { return options_.fit_colors ? 0.9 : 1.0; }

  const Scene& scene_;
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
                    const ReconstructOptions& options, const RunContext& context, const Volume* initial,
                    std::vector<std::string>& notes) {
  std::vector<Topology> lattices = reached_voxels(frames_of_first_level(scene, options), samples, context);
  if (options.min_overlap > 0) {
    const std::int64_t reached = lattices[0].voxel_count();
    const std::int64_t gone =
        drop_little_seen(samples, scene.bounds.box, options.min_overlap, context, lattices);
    if (gone > 0)
      notes.push_back("overlap: " + std::to_string(gone) + " of " + std::to_string(reached) +
                      " places left out, as few nodes have them in frame and many what lies behind");
  }
  Volume volume(std::move(lattices));
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
  const bool open =
      (scene.has_open_ends() && scene.background.kind != BackgroundKind::kNone) || scene.seen_from_inside;
  return open ? Accelerate::kFalling : Accelerate::kBoth;
}

/// The samples of one level, made again when the light that is divided out has changed.
class LevelSamples {
 public:
  LevelSamples(const PhotographLoader& load, SmallPhotographs& small_photographs,
               const ReconstructOptions& options, const RunContext& context, double voxel_size)
      : dataset_(small_photographs.dataset()),
        load_(load),
        small_photographs_(small_photographs),
        options_(options),
        context_(context),
        voxel_size_(voxel_size) {}

  void make(const Scene& scene) {
    samples_ = {};
    drafts_ = {};
    samples_ = make_samples(dataset_, load_, scene, voxel_size_, options_, context_);
    drafts_ = drafts_of(samples_);
  }
  const std::vector<SampleNode>& finest() const { return samples_; }
  const std::vector<SampleNode>& drafts() const { return drafts_; }

  /// The same by the light on each voxel's own surface.
  SurfaceLight paint_by_normal(const Scene& scene, const Daylight& daylight, Volume& volume) const {
    // What is known of a background is a colour of the matching space: here it may be anything.
    PassOptions pass = pass_options(scene, options_);
    if (pass.opacity.background.kind == BackgroundKind::kKnown)
      pass.opacity.background.kind = BackgroundKind::kUnknown;
    Scene in_passing = scene;
    in_passing.memory.sample_bytes = 0;
    const std::vector<SampleNode> samples =
        make_samples(dataset_, load_, in_passing, voxel_size_, options_, context_, SampleColors::kRadiance);
    return paint_without_daylight(dataset_, scene, daylight, samples, pass,
                                  static_cast<float>(options_.opacity_threshold), context_, volume);
  }

  /// Gains anew from the volume's canonical colours; returns whether they moved. Where they did not, the
  /// light stays the one that the samples were made in.
  bool fit_light(const Volume& volume, Scene& scene, LightRecord& record) {
    GainFit fit = fit_gains(volume, small_photographs_, scene, context_);
    record.fitted_views = fit.fitted_views;
    record.largest_change = fit.largest_change;
    record.spread = fit.spread;
    const bool moved = fit.largest_change > kGainMoved;
    if (moved) scene.light.of_views = std::move(fit.of_views);
    return moved;
  }

  /// Gives the voxels the colours of canonical light: those that they are compared by may be others.
  void paint(const Scene& scene, Volume& volume) const {
    const LatticeStack stack(volume);
    const PassOptions pass = pass_options(scene, options_);
    Scene in_passing = scene;
    in_passing.memory.sample_bytes = 0;  // each is marched once: none need stay
    const std::vector<SampleNode> samples =
        make_samples(dataset_, load_, in_passing, voxel_size_, options_, context_, SampleColors::kCanonical);
    CollectedColors colors(volume.slot_count(), samples.size(), 0);
    collect_color(stack, samples, pass, context_, nullptr, colors);
    update_color(colors.totals.color, context_.thread_count(), volume);
    for (std::uint32_t slot = 0; slot < volume.slot_count();
         ++slot)  // what none shows has only the other colour
      if (colors.totals.color[slot][0] <= 0) volume.color_weight[slot] = 0;
  }

 private:
  static constexpr double kGainMoved = 0.005;  ///< ratio less 1: below what matching notices

  const Dataset& dataset_;
  const PhotographLoader& load_;
  SmallPhotographs& small_photographs_;
  const ReconstructOptions& options_;
  const RunContext& context_;
  double voxel_size_;
  std::vector<SampleNode> samples_, drafts_;
};

/// One level's passes.
class LevelPasses {
 public:
  LevelPasses(const ReconstructOptions& options, bool first_ever, const RunContext& context,
              LevelProgress& progress, const ReconstructHooks& hooks)
      : options_(options), first_ever_(first_ever), context_(context), progress_(progress), hooks_(hooks) {}

  /// Passes, the first of them drafts, until the opacities rest or the limit is reached; returns whether they
  /// rest. The last pass is never hurried, and no light changes after it: its opacities follow from its sums
  /// alone, which `merge` relies on. Where its prior is sharpened, its changes are the prior's: whether they
  /// rest says the pass before. `between` is called where another pass follows.
  bool run(LevelSamples& samples, Acceleration& acceleration, const std::function<void()>& between,
           PassState& state, Scene& scene, Volume& volume, Summary& summary) {
    for (;;) {
      const bool draft = ++state.passes <= state.draft_passes;
      const bool last = state.resting || state.passes == most_passes(scene, options_, state.level);
      PassOptions pass = pass_options(scene, options_);
      pass.everywhere = first_ever_ && state.passes == 1;
      if (last && state.level == options_.levels) pass.prior.sharpness = options_.prior_sharpness;
      const bool rested = rests_after(summary, state.level);
      run_one(state, draft, draft ? samples.drafts() : samples.finest(), pass, last ? nullptr : &acceleration,
              volume, summary);
      const bool rests = summary.passes.back().mean_opacity_change < options_.tolerance;
      if (last) return state.resting || (pass.prior.sharpness > 1 ? rested : rests);
      if (scene.light.has_gains() && !state.light_rests) {
        memory_.release();
        fit_light(state, samples, scene, volume, summary);
      }
      if (rests && !options_.all_passes) {
        state.resting = !draft;
        state.draft_passes = std::min(state.draft_passes, state.passes);  // drafts say no more
      }
      between();
    }
  }

 private:
  /// Whether opacities rested in the level's pass that was done last, if there was one.
  bool rests_after(const Summary& summary, int level) const {
    if (summary.passes.empty()) return false;
    const PassRecord& pass = summary.passes.back();
    return pass.level == level && !pass.draft && pass.mean_opacity_change < options_.tolerance;
  }

  void run_one(const PassState& state, bool draft, const std::vector<SampleNode>& samples,
               const PassOptions& pass, Acceleration* acceleration, Volume& volume, Summary& summary) {
    const auto start = Clock::now();
    const PassReport report = run_pass(
        samples, pass, context_,
        [&](double fraction) { progress_.report(state.level, state.passes, fraction); }, volume, acceleration,
        &memory_);
    summary.passes.push_back(
        make_record(state.level, state.passes, draft, volume, report, seconds_since(start)));
    if (!std::isfinite(report.opacity.log_likelihood))
      throw NumericalError("level " + std::to_string(state.level) + ", pass " + std::to_string(state.passes) +
                           ": the log-likelihood is not finite; --noise, --outlier or --uninformative are "
                           "far from what colours are like");
    if (hooks_.after_pass) hooks_.after_pass(summary.passes.back());
  }

  static void fit_light(PassState& state, LevelSamples& samples, Scene& scene, Volume& volume,
                        Summary& summary) {
    if (scene.light.local_matching) samples.paint(scene, volume);
    LightRecord record;
    record.level = state.level;
    record.pass = state.passes;
    state.light_rests = !samples.fit_light(volume, scene, record);
    if (!state.light_rests) samples.make(scene);
    summary.light.push_back(record);
  }

  const ReconstructOptions& options_;
  const bool first_ever_;
  const RunContext& context_;
  LevelProgress& progress_;
  const ReconstructHooks& hooks_;
  PassMemory memory_;
};

/// Photographs whose gains differ by more than this (root mean square of their logarithms) were taken in
/// different light; in one light 0.00 to 0.24 have been measured, 0.65 for tourists' photographs, for what
/// shines and for what the first level cannot resolve.
constexpr double kLightDiffers = 0.35;

/// A volume of fewer voxels along its longest side says more of its own coarseness than of light: a world in
/// one light had gains that differ by half on 8 voxels, by a third on 24.
constexpr double kFewestVoxels = 32;

/// The first level but the last that is fine enough to compare photographs with; none: 0.
int level_to_judge_light(const Scene& scene, const ReconstructOptions& options) {
  const double finest = scene.bounds.box.sizes().maxCoeff() / scene.voxel_size;
  for (int level = 1; level < options.levels; ++level)
    if (std::ldexp(finest, level - options.levels) >= kFewestVoxels * (1 - 1e-6)) return level;
  return 0;
}

/// What --illumination auto knows once there is a first volume: how far the photographs' brightness and
/// tint are apart.
void choose_gain(SmallPhotographs& photographs, const Volume& volume, const RunContext& context, int level,
                 Scene& scene, Summary& summary) {
  GainFit fit = fit_gains(volume, photographs, scene, context);
  const bool differs = fit.spread > kLightDiffers;
  char note[160];
  std::snprintf(note, sizeof note, "light: the images' gains differ by %.0f %% after level %d: %s",
                100 * fit.spread, level,
                differs ? "one gain an image is divided out" : "nothing is divided out");
  summary.notes.push_back(note);
  LightRecord record;
  record.level = level;
  record.fitted_views = fit.fitted_views;
  record.largest_change = fit.largest_change;
  record.spread = fit.spread;
  summary.light.push_back(record);
  if (!differs) return;
  scene.light.from = LightSource::kGain;
  scene.light.of_views = std::move(fit.of_views);
}

PassState start_of_level(const Scene& scene, const ReconstructOptions& options, int level) {
  PassState state;
  state.level = level;
  state.draft_passes = most_drafts(scene, options, level);
  return state;
}

/// Levels one after the other, from nothing or from a checkpoint.
class Levels {
 public:
  Levels(const Dataset& dataset, const PhotographLoader& load, const ReconstructOptions& options,
         RunContext& context, const ReconstructHooks& hooks, double progress_share, Clock::time_point start,
         Reconstruction& made)
      : dataset_(dataset),
        load_(load),
        small_photographs_(dataset, load),
        options_(options),
        context_(context),
        hooks_(hooks),
        progress_(made.scene, options, context, progress_share),
        start_(start),
        made_(made) {}

  void run() {
    if (hooks_.daylight) daylight_ = *hooks_.daylight;
    PassState state = start_of_level(made_.scene, options_, 1);
    if (hooks_.resume) state = take_over();
    for (;; state = start_of_level(made_.scene, options_, state.level + 1)) {
      if (!state.level_done) run_level(state);
      finish_level(state);
      if (state.level == options_.levels) break;
    }
    made_.summary.seconds = seconds_so_far();
  }

 private:
  PassState take_over() {
    Checkpoint& from = *hooks_.resume;
    made_.volume = std::move(from.volume);
    made_.summary = std::move(from.summary);
    made_.scene.light.of_views = std::move(from.light);
    made_.scene.light.from = from.state.light_from;
    if (from.state.level > 1 && hooks_.recall_skies) know_skies(hooks_.recall_skies());
    seconds_before_ = made_.summary.seconds;
    made_.summary.notes.push_back("resumed after level " + std::to_string(from.state.level) + ", pass " +
                                  std::to_string(from.state.passes));
    return from.state;
  }

  void run_level(PassState& state) {
    const auto level_start = Clock::now();
    const PeakMemory memory;
    const double earlier = state.level_seconds;
    const std::int64_t earlier_peak = state.level_peak_bytes;
    const double voxel_size = std::ldexp(made_.scene.voxel_size, options_.levels - state.level);
    LevelSamples samples(load_, small_photographs_, options_, context_, voxel_size);
    samples.make(made_.scene);
    if (state.passes == 0) make_topology(state.level, samples.finest());
    Acceleration acceleration(made_.volume.slot_count(), options_.acceleration, which_steps(made_.scene));
    if (state.passes > 0) acceleration.recall(std::move(hooks_.resume->accelerated));
    const auto offer_checkpoint = [&] {
      state.level_seconds = earlier + seconds_since(level_start);
      state.level_peak_bytes = std::max(earlier_peak, memory.bytes());
      state.light_from = made_.scene.light.from;
      made_.summary.seconds = seconds_so_far();
      made_.summary.peak_memory_bytes = std::max(made_.summary.peak_memory_bytes, peak_memory_bytes());
      if (hooks_.checkpoint)
        hooks_.checkpoint(
            {state, made_.summary, made_.scene.light.of_views, acceleration.memory(), made_.volume});
    };
    const bool first_ever = state.level == 1 && !hooks_.initial;
    LevelRecord record;
    record.voxel_size = voxel_size;
    record.voxels_in_box = made_.volume.box_slot_count();
    record.voxels_around = made_.volume.slot_count() - made_.volume.box_slot_count();
    record.converged =
        LevelPasses(options_, first_ever, context_, progress_, hooks_)
            .run(samples, acceleration, offer_checkpoint, state, made_.scene, made_.volume, made_.summary);
    record.seconds = earlier + seconds_since(level_start);
    record.peak_memory_bytes = std::max(earlier_peak, memory.bytes());
    made_.summary.levels.push_back(record);
    state.level_done = true;
    acceleration.recall({});  // of no use to the next level
    offer_checkpoint();
  }

  /// What follows a level's passes and needs no checkpoint of its own: skies that are emptied, light that is
  /// chosen or found by the
  /// first of several levels, and the colours of the last.
  void finish_level(const PassState& state) {
    const auto start = Clock::now();
    const PeakMemory memory;
    Scene& scene = made_.scene;
    const LevelSamples samples(load_, small_photographs_, options_, context_,
                               std::ldexp(scene.voxel_size, options_.levels - state.level));
    if (options_.empty_sky && daylight_ && daylight_->has_masks() &&
        scene.background.kind == BackgroundKind::kMask)
      empty_the_sky(state.level);
    if (state.level == options_.levels) {
      if (scene.light.by_normal) {
        made_.surface_light = samples.paint_by_normal(scene, *daylight_, made_.volume);
        if (scene.light.has_gains())  // of the colours as they now are, without shading
          scene.light.of_views =
              fit_gains(made_.volume, small_photographs_, scene, context_, GainScale::kOfVolume).of_views;
      } else if (scene.light.local_matching)
        samples.paint(scene, made_.volume);
      if (options_.fit_colors) fit_to_photographs();
    }
    if (options_.illumination == IlluminationChoice::kAuto && scene.light.from == LightSource::kNone &&
        state.level == level_to_judge_light(scene, options_)) {
      if (scene.light.local_matching) samples.paint(scene, made_.volume);
      choose_gain(small_photographs_, made_.volume, context_, state.level, scene, made_.summary);
    }
    if (hooks_.look_at_skies_again && state.level == 1 && options_.levels > 1) look_at_skies_again();
    LevelRecord& record = made_.summary.levels.back();
    record.seconds += seconds_since(start);
    record.peak_memory_bytes = std::max(record.peak_memory_bytes, memory.bytes());
    if (hooks_.after_level) hooks_.after_level(made_.volume, scene, made_.summary);
  }

  void empty_the_sky(int level) {
    const std::int64_t emptied =
        carve_sky(dataset_, load_, daylight_->sky_masked, options_.update, context_, made_.volume);
    if (level == options_.levels && emptied > 0)
      made_.summary.notes.push_back(std::to_string(emptied) +
                                    " voxels that photographs show as sky alone were emptied at the end");
  }

  void fit_to_photographs() {
    const auto start = Clock::now();
    const SurfaceLight* light = made_.surface_light ? &*made_.surface_light : nullptr;
    ColorFitRecord record = fit_colors(
        dataset_, load_, made_.scene, light, context_,
        [&](double fraction) { progress_.report_colors(fraction); }, made_.volume);
    record.seconds = seconds_since(start);
    made_.summary.color_fit = record;
  }

  void look_at_skies_again() {
    std::optional<Daylight> again = hooks_.look_at_skies_again(made_.volume, made_.scene);
    if (!again) return;
    know_skies(std::move(*again));
    if (made_.scene.light.from != LightSource::kSky) return;
    const std::vector<std::array<float, 3>> before = std::move(made_.scene.light.of_views);
    made_.scene.light.of_views = light_of_views(*daylight_, options_.sky_light);
    for (std::size_t v = 0; v < before.size(); ++v)  // gains stay until the next pass
      if (made_.scene.light.is_gain(static_cast<int>(v))) made_.scene.light.of_views[v] = before[v];
  }

  /// Other skies than those of the survey: views may have got a dome's light or a mask.
  void know_skies(Daylight daylight) {
    daylight_ = std::move(daylight);
    small_photographs_.forget();
    Scene& scene = made_.scene;
    for (std::size_t v = 0; v < scene.light.of_dome.size(); ++v)
      scene.light.of_dome[v] = daylight_->of_view(static_cast<int>(v)) != nullptr;
    if (scene.light.from == LightSource::kSky) scene.light.shared = daylight_->sky_of_views;
    for (std::size_t v = 0; v < daylight_->sky_masked.size(); ++v)
      scene.masked[v] |= daylight_->sky_masked[v];
  }

  void make_topology(int level, const std::vector<SampleNode>& samples) {
    made_.volume = level == 1 ? first_volume(made_.scene, samples, options_, context_, hooks_.initial,
                                             made_.summary.notes)
                              : refine(made_.volume, refine_options(options_), context_.thread_count());
  }

  double seconds_so_far() const { return seconds_before_ + seconds_since(start_); }

  const Dataset& dataset_;
  const PhotographLoader& load_;
  SmallPhotographs small_photographs_;  ///< of a run that fits gains
  const ReconstructOptions& options_;
  RunContext& context_;
  const ReconstructHooks& hooks_;
  LevelProgress progress_;
  const Clock::time_point start_;
  double seconds_before_ = 0;  ///< of the run that a checkpoint is from
  Reconstruction& made_;
  std::optional<Daylight> daylight_;
};

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
  pass.kept_color_bytes = static_cast<std::size_t>(scene.memory.kept_color_bytes);
  pass.most_workers = scene.memory.workers;
  return pass;
}

void initialise_from(const Volume& initial, Volume& volume) {
  for (int k = 0; k < volume.lattice_count(); ++k) {
    const BrickIndex& index = volume.index(k);
    for (const Brick& brick : index.bricks())
      brick.for_each_voxel([&](int v, std::uint32_t slot) {
        const Eigen::Vector3d centre = index.frame().voxel_centre(voxel_of(brick, v));
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
      });
  }
}

Reconstruction reconstruct(const Dataset& dataset, const PhotographLoader& load,
                           const ReconstructOptions& options, RunContext& context,
                           const ReconstructHooks& hooks, double progress_share) {
  const auto start = Clock::now();
  PeakMemory memory;
  Reconstruction result;
  Summary& summary = result.summary;
  result.scene = survey(dataset, load, options, context, hooks.daylight);
  summary.notes = dataset.notes;
  summary.notes.insert(summary.notes.end(), result.scene.notes.begin(), result.scene.notes.end());
  if (hooks.after_survey) hooks.after_survey(result.scene);
  summary.stages.push_back({"survey", seconds_since(start), memory.bytes()});

  Levels(dataset, load, options, context, hooks, progress_share, start, result).run();
  summary.termination = summary.levels.back().converged ? "converged" : "pass limit";
  summary.peak_memory_bytes = std::max(summary.peak_memory_bytes, peak_memory_bytes());
  return result;
}

}  // namespace roxel

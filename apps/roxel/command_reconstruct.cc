/// roxel reconstruct: photographs to a volume, then depth, renders and errors of every view.

#include <chrono>
#include <cinttypes>

#include "command.h"
#include "dense_workspace.h"
#include "depth_files.h"
#include "describe.h"
#include "roxel/base/atomic_file.h"
#include "roxel/base/content_hash.h"
#include "roxel/base/error.h"
#include "roxel/base/formatted.h"
#include "roxel/base/parallel.h"
#include "roxel/base/peak_memory.h"
#include "roxel/eval/volume_accuracy.h"
#include "roxel/io/depth_file.h"
#include "roxel/io/voxels_ply.h"
#include "roxel/solve/estimate.h"
#include "roxel/surface/depth_fusion.h"
#include "run_options.h"
#include "run_report.h"
#include "run_skies.h"
#include "view_writer.h"

namespace roxel::cli {
namespace {

constexpr double kVolumeShare = 0.5;  ///< of the bar; what is left is for depth, pictures and surface
constexpr double kVolumeWritten = 0.52;
constexpr double kViewsWritten = 0.58;
constexpr double kDepthRefined = 0.85;

/// Time and memory of a run's stages, one after the other.
class Stopwatch {
 public:
  StageRecord lap(const std::string& name = "") {
    const auto now = Clock::now();
    const StageRecord record{name, std::chrono::duration<double>(now - last_).count(), memory_.bytes()};
    last_ = now;
    memory_.restart();
    return record;
  }
  double total() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now(), last_ = start_;
  PeakMemory memory_;
};

/// The volume to start from; its colours must be in the space that this run compares colours in.
VolumeFile read_initial(const std::string& run, const ReconstructOptions& options) {
  VolumeFile initial = read_volume(std::filesystem::path(run) / "volume.vdb");
  const ColorTransform wanted(options.color_space, parse_white_point(options.white_point, "--white-point"));
  const ColorTransform& found = initial.info.colors;
  if (found.space() != wanted.space() || !(found.white() == wanted.white()))
    throw_invalid("--init " + run,
                  "colours in " + to_string(found.space()) + " with white " + to_string(found.white()),
                  to_string(wanted.space()) + " with white " + to_string(wanted.white()) +
                      ", as --color-space and " + "--white-point say");
  return initial;
}

/// Hashes of the image files, one a view.
std::vector<std::string> hash_images(const Dataset& dataset, const RunContext& context) {
  std::vector<std::string> hashes(dataset.views.size());
  parallel_for(dataset.views.size(), context.thread_count(), [&](std::int64_t v, int) {
    context.throw_if_cancelled();
    hashes[v] = hash_file(dataset.views[v].image_path);
  });
  return hashes;
}

std::string pass_text(const PassRecord& record, int levels, int most_passes) {
  char text[256];
  std::snprintf(text, sizeof text,
                "level %d/%d pass %d/%d: %" PRId64
                " voxels, log-likelihood %.4f, opacity change %.5f, %.1f s",
                record.level, levels, record.pass, most_passes, record.active_voxels,
                record.mean_log_likelihood, record.mean_opacity_change, record.seconds);
  return text;
}

/// Pictures are in the photographs' own response; high dynamic range goes through sRGB.
Response picture_response(const Input& input, const Scene& scene) {
  return scene.exposure == 1 && input.response ? *input.response : Response{};
}

/// One run, step by step.
class Run {
 public:
  Run(const Invocation& invocation, const RunOptions& options)
      : invocation_(invocation),
        options_(options),
        session_(options.common),
        input_(read_input(invocation.inputs.front(), options.input, session_)),
        skies_(invocation, options, session_, input_) {}

  int execute() {
    if (options_.stages.dry_run) return describe_only();
    if (invocation_.output.empty()) throw InvalidInput("-o RUN is missing; see roxel reconstruct --help");
    std::optional<VolumeFile> initial;
    if (options_.stages.init) initial = read_initial(*options_.stages.init, options_.reconstruct);
    session_.context().throw_if_cancelled();
    protect_sources(invocation_.output, sources());
    const OutputFolder folder(invocation_.output);
    warn_of_dataset();
    if (options_.reconstruct.memory)
      require_memory(input_.dataset, lay_out(input_.dataset, input_.load, options_.reconstruct),
                     options_.reconstruct, session_.context().thread_count());
    sweep_leftovers(folder.path());
    if (std::filesystem::exists(folder.path() / "summary.json")) partial_.emplace(folder.path());
    const std::filesystem::path& results = partial_ ? partial_->path() : folder.path();
    run_ = folder.path();
    hashes_ = hash_images(input_.dataset, session_.context());
    stopwatch_.lap();
    RunCheckpoints checkpoints(folder.path(), options_.checkpoints, options_.common, made_from());
    Checkpoint* const resume = checkpoints.find();
    if (resume) seconds_before_ = resume->summary.seconds;
    try {
      if (skies_.find(results)) add_stage("sky");
      warn_of_dataset();
      make_volume(initial ? &initial->volume : nullptr, resume, checkpoints);
      if (initial && initial->info.exposure != made_.scene.exposure)
        warn(options_.common,
             "--init: that run has another exposure, so its colours are brighter or darker than here");
      write_results(folder.path(), results);
    } catch (...) {
      session_.display().clear();
      checkpoints.say_how_to_resume();
      throw;
    }
    checkpoints.remove();
    return 0;
  }

 private:
  Sources sources() const {
    Sources read;
    read.dataset = &input_.dataset;
    if (options_.stages.init) read.folders.push_back(*options_.stages.init);
    if (options_.stages.sky) read.folders.push_back(*options_.stages.sky);
    return read;
  }

  /// Says what has been added to the data set's warnings since the last call.
  void warn_of_dataset() {
    const std::vector<std::string>& all = input_.dataset.warnings;
    for (; warned_ < all.size(); ++warned_) warn(options_.common, all[warned_]);
  }

  int describe_only() {
    const Description description =
        describe(input_, options_.reconstruct, options_.depth, session_.context());
    session_.display().clear();
    print_result(options_.common, description.text, json_text(description.json));
    return 0;
  }

  /// Of what a volume depends on beside images and cameras.
  std::string hash_beside_images() const {
    ContentHash hash;
    for (const View& view : input_.dataset.views) {
      hash.update(view.mask_path.empty() ? "" : hash_file(view.mask_path));
      hash.update(formatted(" %d %.17g %.17g %.17g", view.node_idx, view.time_utc_s.value_or(0),
                            view.latitude_deg.value_or(0), view.longitude_deg.value_or(0)));
      hash.update(formatted(" %.17g %.17g", view.near.value_or(-1), view.far.value_or(-1)));
    }
    const auto add = [&](const Eigen::Vector3d& x) {
      hash.update(formatted(" %.17g %.17g %.17g", x.x(), x.y(), x.z()));
    };
    for (const Eigen::Vector3d& point : input_.dataset.points) add(point);
    if (const auto& box = input_.dataset.scene_bounds) add(box->min()), add(box->max());
    return hash.hex();
  }

  /// What a volume depends on: a checkpoint of anything else is not gone on from.
  nlohmann::ordered_json made_from() const {
    std::string dataset_hash;
    for (std::size_t v = 0; v < hashes_.size(); ++v)
      add_to_hash(input_.dataset.views[v], hashes_[v], dataset_hash);
    nlohmann::ordered_json options = reconstruct_option_table().to_json(options_.reconstruct);
    options.erase("memory");  // no result depends on it
    options.update(input_option_table().to_json(options_.input));
    const nlohmann::ordered_json stages = stage_table().to_json(options_.stages);
    for (const char* name : {"init", "sky", "sun", "sky-masks", "sky-again"}) options[name] = stages.at(name);
    const std::filesystem::path sky = options_.stages.sky.value_or("");
    return {{"version", ROXEL_VERSION},
            {"dataset_hash", dataset_hash},
            {"masks_nodes_times_and_points_hash", hash_beside_images()},
            {"sky_hash", sky.empty() ? "" : hash_folder(sky / "sky")},
            {"sky_masks_hash", hash_folder(options_.stages.sky_masks.value_or(""))},
            {"options", std::move(options)}};
  }

  void make_volume(const Volume* initial, Checkpoint* resume, RunCheckpoints& checkpoints) {
    ReconstructHooks hooks;
    hooks.initial = initial;
    hooks.resume = resume;
    hooks.checkpoint = [&](const CheckpointView& checkpoint) { checkpoints.offer(checkpoint); };
    skies_.add_to(hooks, run_, checkpoints);
    hooks.after_survey = [&](const Scene& scene) {
      for (int level = 1; level <= options_.reconstruct.levels; ++level)
        most_passes_.push_back(most_passes(scene, options_.reconstruct, level));
      for (const std::string& warning : scene.warnings) warn(options_.common, warning);
      if (options_.stages.depth && options_.stages.mesh)
        check_mesh_voxel_size(options_.mesh, scene.voxel_size);
    };
    hooks.after_pass = [&](const PassRecord& record) {
      session_.display().line(
          pass_text(record, options_.reconstruct.levels, most_passes_.at(record.level - 1)));
    };
    std::vector<StageRecord> before = std::move(made_.summary.stages);
    made_ = reconstruct(input_.dataset, input_.load, options_.reconstruct, session_.context(), hooks,
                        kVolumeShare);
    made_.summary.stages.insert(made_.summary.stages.begin(), before.begin(), before.end());
    stopwatch_.lap();
  }

  /// A finished run is replaced as a whole; where there is none, what is written stays even if a later stage
  /// fails, since others can go on from a volume.
  void write_results(const std::filesystem::path& folder, const std::filesystem::path& results) {
    write_volume_files(results);
    write_views(results);
    refine_depth(results);
    export_depth(results);
    session_.context().throw_if_cancelled();
    if (options_.stages.depth && options_.stages.mesh) write_mesh_or_leave_run(results);
    if (options_.stages.report) write_report(results);
    const std::string json = write_summary(results);
    if (partial_) partial_->publish([&] { remove_results(folder); });
    say_results(json);
  }

  void write_volume_files(const std::filesystem::path& results) {
    report("writing", kVolumeShare);
    write_volume(results / "volume.vdb", made_.volume, volume_info(),
                 options_.stages.save_surround ? SavedLattices::kAll : SavedLattices::kBoxOnly);
    session_.context().throw_if_cancelled();
    write_voxels_ply(results / "voxels.ply", made_.volume, made_.scene.transform,
                     static_cast<float>(options_.reconstruct.opacity_threshold),
                     static_cast<float>(options_.reconstruct.confidence_threshold));
    session_.context().throw_if_cancelled();
    add_stage("write volume");
    report("writing", kVolumeWritten);
  }

  void write_views(const std::filesystem::path& results) {
    ViewWriter writer(results, input_.dataset, made_.scene.exposure, picture_response(input_, made_.scene));
    ViewStageOptions stages;
    stages.depth = options_.stages.depth;
    stages.render = options_.stages.render;
    stages.depth_options = options_.depth.map;
    stages.progress_begin = kVolumeWritten;
    stages.progress_end = kViewsWritten;
    if (options_.depth.bp || options_.depth.refine) writer.expect_more_depth();
    if (options_.stages.report) writer.keep_for_report(made_.scene.voxel_size);
    for_each_view_result(input_.dataset, input_.load, made_, options_.reconstruct, stages, session_.context(),
                         [&](const ViewResult& result) { writer.write(result); });
    writer.write_overview();
    views_ = writer.figures();
    report_views_ = writer.report_pictures();
    reprojection_rms_ = writer.reprojection_rms();
    if (stages.depth || stages.render) add_stage("depth and pictures");
  }

  /// Belief propagation and refinement of what write_views has written.
  void refine_depth(const std::filesystem::path& results) {
    if (!options_.stages.depth || !(options_.depth.bp || options_.depth.refine)) return;
    refined_ = refine_depth_files(input_.dataset, input_.load, {made_.scene.exposure, made_.scene.voxel_size},
                                  {{results, results}, options_.reconstruct.memory}, options_.depth,
                                  session_.context(), kViewsWritten, kDepthRefined);
    for (const StageRecord& record : stage_records(*refined_)) made_.summary.stages.push_back(record);
    for (ReportView& view : report_views_)
      add_refined_pictures(read_depth(depth_path(results, view.name)), made_.scene.voxel_size, view);
    stopwatch_.lap();
  }

  void export_depth(const std::filesystem::path& results) {
    if (!options_.stages.depth || options_.stages.exported == Export::kNone) return;
    unless_no_surface("no export", [&] {
      write_dense_workspace(input_.dataset, input_.load, results, results / "colmap", made_.scene.exposure,
                            made_.scene.voxel_size, session_.context());
    });
    add_stage("export");
  }

  /// Where there is no surface, a run still has its volume: said, not failed.
  template <class Work>
  void unless_no_surface(const std::string& what, const Work& work) {
    try {
      work();
    } catch (const NoSurface& error) {
      made_.summary.notes.push_back(what + ": " + error.what());
      warn(options_.common, made_.summary.notes.back());
    }
  }

  void add_stage(const char* name) { made_.summary.stages.push_back(stopwatch_.lap(name)); }

  VolumeInfo volume_info() const {
    VolumeInfo info;
    info.colors = made_.scene.transform;
    info.exposure = made_.scene.exposure;
    info.dataset = input_.dataset.path;
    return info;
  }

  void write_mesh(const std::filesystem::path& results) {
    const MeshInput source{input_.dataset,
                           input_.load,
                           made_.volume,
                           volume_info(),
                           made_.scene.bounds.box,
                           results,
                           options_.reconstruct.memory,
                           kDepthRefined,
                           0.98};
    unless_no_surface("no mesh", [&] {
      MeshResult mesh = make_mesh(source, options_.mesh, results, session_.context());
      mesh_figures_ = std::move(mesh.figures);
      report_mesh_ = std::move(mesh.pictures);
      for (const std::string& warning : mesh.warnings) warn(options_.common, warning);
    });
    add_stage("mesh");
  }

  /// Where options ask for a mesh that cannot be made, a new run is left with all but that, for `roxel mesh`.
  void write_mesh_or_leave_run(const std::filesystem::path& results) {
    try {
      write_mesh(results);
    } catch (const InvalidInput& error) {
      if (!partial_) {
        made_.summary.notes.push_back(std::string("no mesh: ") + error.what());
        write_summary(results);
      }
      throw;
    }
  }

  nlohmann::ordered_json summary_so_far() {
    made_.summary.seconds = seconds_before_ + stopwatch_.total();
    made_.summary.peak_memory_bytes = std::max(made_.summary.peak_memory_bytes, peak_memory_bytes());
    nlohmann::ordered_json json = to_json(make_record(session_.context().thread_count()));
    if (refined_) json["depth"] = to_json(*refined_);
    return json;
  }

  void write_report(const std::filesystem::path& results) {
    ReportContent content{summary_so_far(), std::move(report_views_), std::move(report_mesh_), {}, {}};
    const Eigen::Vector3d middle = made_.scene.bounds.box.center();
    for (int axis = 0; axis < 3; ++axis)
      content.sections.push_back(opacity_section(made_.volume, axis, middle[axis]));
    content.opacities = saved_voxels(made_.volume, 0, 0).opacity;
    add_skies(results, content);
    write_text_atomically(results / "report.html", html_report(content));
    add_stage("report");
  }

  std::string write_summary(const std::filesystem::path& results) {
    const std::string json = json_text(summary_so_far());
    write_text_atomically(results / "summary.json", json + "\n");
    return json;
  }

  void say_results(const std::string& json) {
    for (const std::string& note : made_.summary.notes) session_.display().detail(note);
    for (const StageRecord& stage : made_.summary.stages)
      session_.display().detail(stage.name + ": " + duration_text(stage.seconds));
    session_.display().clear();
    print_result(options_.common, brief(), json);
  }

  RunRecord make_record(int threads) const {
    RunRecord record;
    record.command_line = invocation_.line;
    record.dataset_path = input_.dataset.path;
    record.dataset_format = input_.dataset.format;
    record.nodes = static_cast<int>(input_.dataset.nodes.size());
    record.options = run_table().to_json(options_);
    record.threads = threads;
    record.scene = made_.scene;
    record.frame = made_.volume.index(0).frame();
    record.summary = made_.summary;
    record.skies = skies_.nodes();
    record.skies_again = skies_.again();
    record.warnings = input_.dataset.warnings;
    record.warnings.insert(record.warnings.end(), made_.scene.warnings.begin(), made_.scene.warnings.end());
    record.views = views_;
    record.reprojection_rms = reprojection_rms_;
    record.mesh = mesh_figures_;
    for (std::size_t v = 0; v < hashes_.size(); ++v) {
      record.views[v].hash = hashes_[v];
      add_to_hash(input_.dataset.views[v], hashes_[v], record.dataset_hash);
    }
    return record;
  }

  std::string brief() const {
    std::string text = made_.summary.brief() + "\n";
    if (refined_) text += cli::brief(*refined_);
    if (reprojection_rms_) {
      char line[64];
      std::snprintf(line, sizeof line, "reprojection error %.2f %% of full scale\n", *reprojection_rms_);
      text += line;
    }
    return text + "written to " + invocation_.output.string() + "\n";
  }

  void report(const char* stage, double fraction) {
    Progress progress;
    progress.stage = stage;
    progress.fraction = fraction;
    session_.context().report(progress);
  }

  const Invocation& invocation_;
  const RunOptions& options_;
  Session session_;
  Input input_;
  std::size_t warned_ = 0;  ///< of the data set's warnings
  std::vector<std::string> hashes_;
  Stopwatch stopwatch_;
  std::optional<PartialResults> partial_;
  RunSkies skies_;
  double seconds_before_ = 0;  ///< of the parts before this one, of a run that is resumed
  std::filesystem::path run_;
  std::vector<int> most_passes_;  ///< of each level
  Reconstruction made_;
  std::vector<ViewFigures> views_;
  std::vector<ReportView> report_views_;
  std::optional<DepthStageFigures> refined_;
  nlohmann::ordered_json mesh_figures_;
  ReportMesh report_mesh_;
  std::optional<double> reprojection_rms_;
};

int run_reconstruct(const Invocation& invocation, const RunOptions& options) {
  return Run(invocation, options).execute();
}

}  // namespace

void add_reconstruct(Commands& commands) {
  CommandForm form{"reconstruct", "Make a volume from calibrated photographs, then depth maps and renders",
                   "DATASET", "RUN"};
  form.output_required = false;  // a dry run writes nothing
  form.details =
      "What is in RUN afterwards: summary.json, volume.vdb, voxels.ply, overview.png, report.html, "
      "mesh.ply, mesh.glb,\nmesh.obj, mesh_views.png, mesh_turntable.jpg, and for every image\n"
      "depth/NAME.exr (and .png), render/NAME.png, error/NAME.png.\n";
  add_command(commands, form, run_table(), run_reconstruct);
}

}  // namespace roxel::cli

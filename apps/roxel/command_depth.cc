/// roxel depth: belief propagation and refinement of a finished run's depth maps, again or for the first
/// time.

#include <chrono>
#include <nlohmann/json.hpp>

#include "command.h"
#include "common.h"
#include "depth_files.h"
#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/io/depth_file.h"
#include "roxel/report/run_record.h"
#include "roxel/solve/run_stages.h"
#include "run_input.h"
#include "run_report.h"
#include "sky_stage.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

struct DepthCommandOptions {
  std::optional<std::string> dataset;
  bool from_volume = false;
  DepthStageOptions stage;
  MemoryOptions memory;
  CommonOptions common;
};

OptionTable<DepthCommandOptions> depth_table() {
  OptionTable<DepthCommandOptions> table;
  table.group("Source");
  table.add("dataset", &DepthCommandOptions::dataset)
      .help("Where the run's photographs and cameras are now")
      .placeholder("DATASET")
      .unset("where the run has read them");
  table.add("from-volume", &DepthCommandOptions::from_volume)
      .help(
          "March through the volume again; else only where the run has no depth maps, or others than "
          "--depth-estimate and --depth-weight ask for");
  table.include(depth_option_table(), &DepthCommandOptions::stage);
  table.include(memory_option_table(), &DepthCommandOptions::memory);
  table.include(common_option_table(), &DepthCommandOptions::common);
  return table;
}

/// The options of `reconstruct` as the run used them.
ReconstructOptions options_of(const FinishedRun& run) {
  ReconstructOptions options;
  nlohmann::json used = nlohmann::json::object();
  for (const OptionField& field : reconstruct_option_table().fields())
    if (const nlohmann::json& value = run.option(field.name); !value.is_null()) used[field.name] = value;
  reconstruct_option_table().apply_json(options, used, (run.path / "summary.json").string() + ": options");
  return options;
}

/// How the run's depth maps were made.
nlohmann::ordered_json map_options_of(const FinishedRun& run) {
  nlohmann::ordered_json options = depth_map_option_table().to_json({});
  for (auto& [name, value] : options.items())
    if (const nlohmann::json& used = run.option(name); !used.is_null()) value = used;
  return options;
}

bool has_depth_maps(const fs::path& run, const Dataset& dataset) {
  return std::all_of(dataset.views.begin(), dataset.views.end(),
                     [&](const View& view) { return fs::is_regular_file(depth_path(run, view.name)); });
}

/// The run whose skies this one has used, which may be itself; empty where it has used none.
fs::path skies_of(const FinishedRun& run) {
  if (fs::is_directory(run.path / "sky")) return run.path;
  const nlohmann::json& taken = run.option("sky");
  return taken.is_string() ? fs::path(taken.get<std::string>()) : fs::path();
}

/// Z, V, A of every view, from the saved volume.
void march(FinishedRun& run, Input input, const DepthOptions& wanted, const fs::path& results,
           RunContext& context, double share) {
  const ReconstructOptions options = options_of(run);
  Reconstruction made;
  std::optional<Daylight> daylight;
  if (const fs::path skies = skies_of(run); !skies.empty()) {
    daylight = read_daylight(skies, input.dataset);
    if (daylight->has_masks()) input.load = with_sky_masks(input.load, skies);
  }
  made.scene = survey(input.dataset, input.load, options, context, daylight ? &*daylight : nullptr);
  made.scene.light = light_of_run(run, input.dataset);
  made.volume = std::move(run.file.volume);
  ViewStageOptions stages;
  stages.render = false;
  stages.depth_options = wanted;
  stages.progress_end = share;
  for_each_view_result(input.dataset, input.load, made, options, stages, context,
                       [&](const ViewResult& result) {
                         write_depth(depth_path(results, input.dataset.views[result.view_idx].name),
                                     {result.depth.depth, result.depth.variance, result.depth.opacity},
                                     ExrCompression::kNone);  // the stage that follows writes it again
                       });
  run.file.volume = std::move(made.volume);
}

/// The run's summary with this stage's figures in the place of older ones.
nlohmann::ordered_json new_summary(const FinishedRun& run, const DepthStageFigures& figures,
                                   const nlohmann::ordered_json& options) {
  nlohmann::ordered_json summary(run.summary);
  const std::vector<StageRecord> records = stage_records(figures);
  nlohmann::ordered_json stages = nlohmann::ordered_json::array();
  for (const auto& stage : summary.value("stages", nlohmann::ordered_json::array()))
    if (const std::string name = stage.value("name", "");
        name != kPropagationStage && name != kRefinementStage)
      stages.push_back(stage);
  for (const StageRecord& r : records) stages.push_back(to_json(r));
  summary["stages"] = stages;
  for (const auto& [name, value] : options.items()) summary["options"][name] = value;
  summary["depth"] = to_json(figures);
  return summary;
}

int run_depth(const Invocation& invocation, const DepthCommandOptions& options) {
  Session session(options.common);
  FinishedRun run = read_run(invocation.inputs.front());
  if (run.file.volume.box_slot_count() == 0)
    throw_invalid((run.path / "volume.vdb").string(), "no voxels", "a volume with voxels in its box");
  const double voxel_size = run.file.volume.index(0).frame().voxel_size;
  const Input input = read_input_of(run, options.dataset, session);
  const OutputFolder folder(run.path);
  PartialResults results(folder.path());
  double begin = 0;
  if (options.from_volume || !has_depth_maps(run.path, input.dataset) ||
      map_options_of(run) != depth_map_option_table().to_json(options.stage.map)) {
    begin = 0.3;
    march(run, input, options.stage.map, results.path(), session.context(), begin);
  }
  const DepthStageFigures figures = refine_depth_files(
      input.dataset, input.load, {run.file.info.exposure, voxel_size},
      {{results.path(), run.path}, options.memory.memory}, options.stage, session.context(), begin, 1);
  session.context().throw_if_cancelled();
  if ((options.stage.bp || options.stage.refine) && figures.propagation.pixels + figures.refined_pixels == 0)
    throw_invalid((run.path / "depth").string(), "no pixel with depth in any view",
                  "depth maps of a surface in the run's box");
  const nlohmann::ordered_json summary =
      new_summary(run, figures, depth_option_table().to_json(options.stage));
  if (has_report(run))
    write_run_report({run, input, {results.path(), run.path}, summary}, mesh_pictures_of(run.path),
                     session.context());
  write_text_atomically(results.path() / "summary.json", json_text(summary) + "\n");
  results.publish();
  session.display().clear();
  if (fs::is_regular_file(run.path / "mesh.ply"))
    warn(options.common, "the mesh is still that of the earlier depth maps: roxel mesh " + run.path.string() +
                             " makes it anew");
  if (fs::is_directory(run.path / "colmap"))
    warn(options.common, "colmap is still of the earlier depth maps: roxel convert " + run.path.string() +
                             " --to colmap-dense makes a new one");
  print_result(options.common, brief(figures) + "written to " + run.path.string() + "\n",
               json_text(to_json(figures)));
  return 0;
}

}  // namespace

void add_depth(Commands& commands) {
  CommandForm form{"depth", "Refine the depth maps of a finished run", "RUN"};
  form.details =
      "Adds to RUN/depth/NAME.exr the channels Z.bp, V.bp (belief propagation), and Z.refined, V.refined,\n"
      "N.x, N.y, N.z (photometric refinement); RUN/summary.json says what it did.\n";
  add_command(commands, form, depth_table(), run_depth);
}

}  // namespace roxel::cli

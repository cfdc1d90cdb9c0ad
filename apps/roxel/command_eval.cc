/// roxel eval: a run against the truth (depth) and against its own photographs (reprojection).

#include <nlohmann/json.hpp>

#include "command.h"
#include "common.h"
#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/eval/depth_accuracy.h"
#include "roxel/eval/image_error.h"
#include "roxel/io/depth_file.h"
#include "roxel/io/image_file.h"
#include "roxel/report/run_record.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct EvalOptions {
  std::optional<std::string> truth;
  InputOptions input;
  CommonOptions common;
};

OptionTable<EvalOptions> eval_table() {
  OptionTable<EvalOptions> table;
  table.group("Truth");
  table.add("truth", &EvalOptions::truth)
      .help("Folder with depth/NAME.exr: true distance along the optical axis, 0 = no surface")
      .placeholder("DIR")
      .unset("the data set, where it has a depth folder");
  table.include(common_option_table(), &EvalOptions::common);
  return table;
}

/// What is known of each view, from the run's files.
struct Metrics {
  std::vector<NamedDepthAccuracy> depth;
  DepthAccuracy all_depth;
  struct Reprojection {
    std::string name;
    double rms_percent;
  };
  std::vector<Reprojection> reprojection;
};

std::vector<std::string> view_names(const FinishedRun& run) {
  std::vector<std::string> names;
  for (const auto& view : run.summary.value("views", nlohmann::json::array()))
    names.push_back(view.value("name", ""));
  return names;
}

/// The true depth of a view: by its name, or by the file name alone.
std::optional<fs::path> truth_file(const fs::path& truth, const std::string& name) {
  for (const std::string& candidate : {name, fs::path(name).filename().string()}) {
    const fs::path file = view_path(truth, "depth", candidate, ".exr");
    if (fs::is_regular_file(file)) return file;
  }
  return {};
}

std::optional<fs::path> truth_folder(const EvalOptions& options, const FinishedRun& run) {
  if (options.truth) {
    if (!fs::is_directory(fs::path(*options.truth) / "depth"))
      throw_invalid("--truth " + *options.truth, "no folder depth in it",
                    "depth/NAME.exr for the images of the run");
    return *options.truth;
  }
  const fs::path dataset = run.file.info.dataset;
  if (fs::is_directory(dataset / "depth")) return dataset;
  return {};
}

DepthAccuracy view_accuracy(const fs::path& estimate_file, const fs::path& truth_path, double voxel_size) {
  const DepthLayers estimate = read_depth(estimate_file);
  const std::vector<FloatChannel> truth = read_exr_channels(truth_path.string());
  const Image& plane = truth.front().plane;
  if (plane.width() != estimate.depth.width() || plane.height() != estimate.depth.height())
    throw_invalid(truth_path.string(),
                  std::to_string(plane.width()) + " x " + std::to_string(plane.height()) + " pixels",
                  std::to_string(estimate.depth.width()) + " x " + std::to_string(estimate.depth.height()) +
                      " as " + estimate_file.string() + " has");
  DepthAccuracyOptions options;
  options.voxel_size = voxel_size;
  return depth_accuracy({estimate.depth.data(), estimate.variance.data(), estimate.opacity.data()},
                        plane.data(), options);
}

void measure_depth(const FinishedRun& run, const fs::path& truth, const RunContext& context,
                   Metrics& metrics) {
  const double voxel_size = run.file.volume.index(0).frame().voxel_size;
  for (const std::string& name : view_names(run)) {
    context.throw_if_cancelled();
    const fs::path estimate = depth_path(run.path, name);
    const std::optional<fs::path> file = truth_file(truth, name);
    if (!file || !fs::is_regular_file(estimate)) continue;
    metrics.depth.push_back({name, view_accuracy(estimate, *file, voxel_size)});
    if (metrics.depth.size() == 1)
      metrics.all_depth = metrics.depth.front().accuracy;
    else
      metrics.all_depth.add(metrics.depth.back().accuracy);
  }
}

void take_reprojection(const FinishedRun& run, Metrics& metrics) {
  for (const auto& view : run.summary.value("views", nlohmann::json::array())) {
    const auto rms = view.find("reprojection_rms_percent");
    if (rms != view.end() && rms->is_number())
      metrics.reprojection.push_back({view.value("name", ""), rms->get<double>()});
  }
}

ordered_json accuracy_json(const DepthAccuracy& accuracy) {
  ordered_json within;
  for (std::size_t i = 0; i < accuracy.thresholds.size(); ++i) {
    char voxels[16];
    std::snprintf(voxels, sizeof voxels, "%g", accuracy.thresholds[i]);
    within[voxels] = accuracy.share_within(i);
  }
  return {{"true_pixels", accuracy.true_pixels},
          {"share_found", accuracy.share_found()},
          {"share_within_voxels", within},
          {"bias_voxels", accuracy.bias_voxels()},
          {"empty_pixels", accuracy.empty_pixels},
          {"share_of_empty_given_depth", accuracy.share_false()},
          {"share_within_sigma",
           {{"1", accuracy.share_within_sigma(1)},
            {"2", accuracy.share_within_sigma(2)},
            {"3", accuracy.share_within_sigma(3)}}},
          {"median_normalized_error", accuracy.median_normalized_error()}};
}

ordered_json metrics_json(const FinishedRun& run, const std::optional<fs::path>& truth,
                          const Metrics& metrics) {
  ordered_json json{
      {"run", run.path.string()},
      {"voxel_size", run.file.volume.index(0).frame().voxel_size},
      {"reprojection_rms_percent", run.summary.value("reprojection_rms_percent", nlohmann::json())}};
  json["depth"] = nullptr;
  if (!metrics.depth.empty()) {
    json["depth"] = accuracy_json(metrics.all_depth);
    json["depth"]["truth"] = truth->string();
    json["depth"]["views"] = ordered_json::array();
    for (const NamedDepthAccuracy& view : metrics.depth) {
      ordered_json entry{{"name", view.name}};
      entry.update(accuracy_json(view.accuracy));
      json["depth"]["views"].push_back(entry);
    }
  }
  json["reprojection"] = ordered_json::array();
  for (const auto& view : metrics.reprojection)
    json["reprojection"].push_back({{"name", view.name}, {"rms_percent", view.rms_percent}});
  return json;
}

std::string metrics_text(const FinishedRun& run, const Metrics& metrics) {
  std::string text;
  if (!metrics.depth.empty()) text += depth_accuracy_table(metrics.depth) + "\n";
  const auto rms = run.summary.find("reprojection_rms_percent");
  char line[96];
  if (rms != run.summary.end() && rms->is_number()) {
    std::snprintf(line, sizeof line, "reprojection error %.2f %% of full scale\n", rms->get<double>());
    text += line;
  }
  return text;
}

int run_eval(const Invocation& invocation, const EvalOptions& options) {
  Session session(options.common);
  const FinishedRun run = read_run(invocation.inputs.front());
  const std::optional<fs::path> truth = truth_folder(options, run);
  session.context().throw_if_cancelled();
  if (!invocation.output.empty()) protect_sources(invocation.output, {{run.path, truth.value_or(run.path)}});
  Metrics metrics;
  if (truth) measure_depth(run, *truth, session.context(), metrics);
  take_reprojection(run, metrics);
  if (options.truth && metrics.depth.empty())
    throw_invalid("--truth " + *options.truth, "no depth/NAME.exr for any depth map of " + run.path.string(),
                  "files named like the images of the run");
  if (metrics.depth.empty() && metrics.reprojection.empty())
    throw_invalid(run.path.string(), "neither true depth nor renders to measure by",
                  "--truth DIR, or a run with renders");
  const std::string json = json_text(metrics_json(run, truth, metrics));
  if (!invocation.output.empty()) {
    const OutputFolder folder(invocation.output);
    write_text_atomically(invocation.output / "metrics.json", json + "\n");
  }
  print_result(options.common, metrics_text(run, metrics), json);
  return 0;
}

}  // namespace

void add_eval(Commands& commands) {
  CommandForm form{"eval", "Measure a run: depth against the truth, renders against the photographs", "RUN",
                   "DIR"};
  form.output_required = false;
  form.details = "Prints a table a view, in percent, and writes DIR/metrics.json with -o.\n";
  add_command(commands, form, eval_table(), run_eval);
}

}  // namespace roxel::cli

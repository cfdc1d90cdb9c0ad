/// roxel eval: a run against the truth (surface, depth, colour) and against photographs.

#include <charconv>
#include <nlohmann/json.hpp>

#include "command.h"
#include "common.h"
#include "eval_measure.h"
#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/io/depth_file.h"
#include "roxel/io/image_file.h"
#include "roxel/io/sky_truth.h"
#include "roxel/report/html_report.h"
#include "roxel/report/measure_plots.h"
#include "roxel/report/pictures.h"
#include "roxel/report/section_picture.h"
#include "run_report.h"
#include "view_writer.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

struct TruthOptions {
  std::optional<std::string> truth;
  std::optional<std::string> dataset;
};

struct MeasureSwitches {
  std::optional<std::string> depth_within;
  std::optional<std::string> distances;
  std::optional<std::string> estimate;
  double opacity_threshold = 0.04;
  double confidence_threshold = 0.001;
  int views_agree = 2;
  double sure_within = 4;
  int samples = 200000;
  std::int64_t seed = 1;
  std::optional<std::array<double, 3>> section;
};

struct EvalOptions {
  TruthOptions truth;
  MeasureSwitches measures;
  CommonOptions common;
};

OptionTable<TruthOptions> truth_table() {
  OptionTable<TruthOptions> table;
  table.group("Truth");
  table.add("truth", &TruthOptions::truth)
      .help(
          "Folder with depth/NAME.exr (true distance along the optical axis, 0 = no surface), mesh.ply, "
          "albedo/NAME.exr, transforms_test.json (held-out views), illumination.json (light of nodes); "
          "what is missing is not measured")
      .placeholder("DIR")
      .unset("the data set, where it has any of that");
  table.add("dataset", &TruthOptions::dataset)
      .help("Where the run's photographs and cameras are now")
      .placeholder("DATASET")
      .unset("where the run has read them");
  return table;
}

OptionTable<MeasureSwitches> measure_table() {
  OptionTable<MeasureSwitches> table;
  table.group("Measures");
  table.add("depth-within", &MeasureSwitches::depth_within)
      .help("Count pixels whose depth is within these distances, too")
      .placeholder("D,...")
      .unset("0.5, 1, 2, 4 and 8 voxels alone");
  table.add("distances", &MeasureSwitches::distances)
      .help("Distances of precision and recall")
      .placeholder("D,...")
      .unset("0.5 % and 1 % of the box's diagonal; 1, 2 and 4 voxels");
  table.add("estimate", &MeasureSwitches::estimate)
      .help("Measure this mesh or point set, too")
      .placeholder("FILE.ply")
      .unset("depth points, voxels and mesh.ply of the run alone");
  table.add("opacity-threshold", &MeasureSwitches::opacity_threshold)
      .help("Voxels of at least this opacity are measured")
      .range(0, 0.999)
      .source("the default of reconstruct; fixed, so that runs compare");
  table.add("confidence-threshold", &MeasureSwitches::confidence_threshold)
      .help(
          "Of these, those of at least this confidence: what hardly any photograph has looked at does not "
          "count")
      .range(0, 0.999)
      .source("the default of reconstruct; fixed, so that runs compare");
  table.add("views-agree", &MeasureSwitches::views_agree)
      .help("Depth maps that must agree on a point of the stricter set of depth points")
      .range(2, 1000);
  table.add("sure-within", &MeasureSwitches::sure_within)
      .help("Most deviation of depth of a set of depth points that the run is sure of")
      .unit("voxels")
      .above(0)
      .source("docs/evaluation.md, Surfaces");
  table.add("samples", &MeasureSwitches::samples)
      .help("Points drawn on the true surface, and on a mesh to measure")
      .range(1000, 100000000)
      .source("standard error of a share: at most 0.1 %");
  table.add("seed", &MeasureSwitches::seed).help("Draws other points").at_least(0);
  table.add("section", &MeasureSwitches::section)
      .help("Point that the three cross-sections go through")
      .unset("the middle of the box");
  return table;
}

OptionTable<EvalOptions> eval_table() {
  OptionTable<EvalOptions> table;
  table.include(truth_table(), &EvalOptions::truth);
  table.include(measure_table(), &EvalOptions::measures);
  table.include(common_option_table(), &EvalOptions::common);
  return table;
}

/// "0.1,0.2": numbers above 0, sorted.
std::vector<double> parse_distances(const std::optional<std::string>& text, const std::string& where) {
  std::vector<double> distances;
  if (!text) return distances;
  const char *at = text->data(), *end = at + text->size();
  for (;;) {
    double value = 0;
    const auto [stop, error] = std::from_chars(at, end, value);
    if (error != std::errc() || !(value > 0) || !std::isfinite(value) || (stop != end && *stop != ','))
      throw_invalid(where, "\"" + *text + "\"", "distances above 0, separated by commas");
    distances.push_back(value);
    if (stop == end) break;
    at = stop + 1;
  }
  std::sort(distances.begin(), distances.end());
  return distances;
}

MeasureOptions measure_options(const MeasureSwitches& switches) {
  MeasureOptions options;
  options.depth_within = parse_distances(switches.depth_within, "--depth-within");
  options.distances = parse_distances(switches.distances, "--distances");
  options.opacity_threshold = switches.opacity_threshold;
  options.confidence_threshold = switches.confidence_threshold;
  options.views_agree = switches.views_agree;
  options.sure_within = switches.sure_within;
  options.samples = switches.samples;
  options.seed = static_cast<std::uint64_t>(switches.seed);
  options.section = switches.section;
  return options;
}

Sources sources_of(const EvalSource& source) {
  Sources sources{{source.run.path, source.truth.value_or(source.run.path)}};
  if (source.input) sources.dataset = &source.input->dataset;
  return sources;
}

/// What was asked for by name must give something.
void check_measured(const EvalOptions& options, const RunMeasures& measures) {
  const bool by_truth = !measures.depth.empty() || measures.volume || !measures.surfaces.empty() ||
                        measures.color || !measures.held_out.empty() || !measures.skies.empty();
  if (options.truth.truth && !by_truth) {
    std::string found = "nothing to measure " + measures.run + " by";
    for (const std::string& note : measures.notes) found += "; " + note;
    throw_invalid(
        "--truth " + *options.truth.truth, found,
        "depth/NAME.exr or albedo/NAME.exr named like the images of the run, mesh.ply with a surface "
        "in its box, or transforms_test.json");
  }
  if (measures.empty())
    throw_invalid(measures.run, "neither truth nor renders to measure by",
                  "--truth DIR, or a run with renders");
}

/// As it is, and over the run's light.
void add_photograph(const EvalSource& source, const View& view, ReportView& shown) {
  const Image photo = source.input->load(view).rgb;
  const auto add = [&](const char* caption, const Image& rgb) {
    if (!rgb.empty())
      shown.pictures.push_back(report_picture(
          caption, encoded_picture(rgb, source.run.file.info.exposure, source.picture_response())));
  };
  add("photograph", photo);
  add(kOverItsLight, over_light_of(source.run, source.input->dataset, view, photo));
}

/// Pictures that the run has of the views that the page shows, and the photographs where they are there.
std::vector<ReportView> report_views_of(const EvalSource& source) {
  std::vector<ReportView> views;
  for (const int v : report_views(static_cast<int>(source.view_names.size()))) {
    const std::string& name = source.view_names[v];
    ReportView shown{name, {}, {}};
    if (const View* view = source.view(name)) add_photograph(source, *view, shown);
    for (const char* kind : {"render", "error", "depth"})
      if (const fs::path file = view_path(source.run.path, kind, name, ".png"); fs::is_regular_file(file))
        shown.pictures.push_back(report_picture(kind, read_image(file.string(), kAsItIs).rgb));
    if (const fs::path file = depth_path(source.run.path, name); fs::is_regular_file(file)) {
      const DepthLayers layers = read_depth(file);
      const Image truth = true_depth_of(source, name);
      const auto show = [&](const std::string& method, const Image& depth, const Image& variance) {
        if (depth.empty()) return;
        shown.pictures.push_back(report_picture(
            "sigma of depth" + method, sigma_picture(variance, depth, layers.opacity, source.voxel_size())));
        if (!truth.empty())
          shown.pictures.push_back(
              report_picture("depth error" + method,
                             depth_error_picture(depth, layers.opacity, truth, source.voxel_size())));
      };
      show("", layers.depth, layers.variance);
      show(", after belief propagation", layers.depth_bp, layers.variance_bp);
      show(", refined", layers.depth_refined, layers.variance_refined);
    }
    if (!shown.pictures.empty()) views.push_back(std::move(shown));
  }
  return views;
}

std::string report_page(const EvalSource& source, const RunMeasures& measures) {
  ReportContent content{nlohmann::ordered_json(source.run.summary),
                        report_views_of(source),
                        {},
                        measures.sections,
                        {},
                        &measures};
  content.opacities = saved_voxels(source.run.file.volume, 0, 0).opacity;
  add_skies(source.run.path, content);
  return html_report(content);
}

void remove_file(const fs::path& file) {
  std::error_code ignored;
  if (!fs::is_directory(fs::symlink_status(file, ignored))) fs::remove(file, ignored);
}

/// The files of an earlier eval, metrics.json first, so that measures of two never mix. Does nothing where
/// there is no metrics.json.
void remove_older_measures(const fs::path& folder) {
  if (!fs::is_regular_file(folder / "metrics.json")) return;
  for (const char* name : {"metrics.json", "report.html", "section_x.svg", "section_y.svg", "section_z.svg"})
    remove_file(folder / name);
  for (const char* name :
       {"depth", "depth_methods", "depth_error_over_sigma", "opacity_reliability", "surfaces", "color",
        "voxel_distances", "voxel_opacities", "sky_debris", "images", "held_out", "light", "skies"})
    for (const char* suffix : {".csv", ".svg"}) remove_file(folder / (std::string(name) + suffix));
  const auto surface_plot = [&](int number) {
    return folder / ("surface_" + std::to_string(number) + ".svg");
  };
  for (int i = 1; fs::exists(surface_plot(i)); ++i) remove_file(surface_plot(i));
}

void write_files(const fs::path& folder, const EvalSource& source, const RunMeasures& measures,
                 const std::string& json) {
  for (const auto& [name, table] : csv_tables(measures)) write_text_atomically(folder / name, table);
  for (const auto& [name, plot] : measure_plots(measures))
    write_text_atomically(folder / (name + ".svg"), svg_plot(plot));
  for (const Section& section : measures.sections)
    write_text_atomically(folder / (std::string("section_") + "xyz"[section.axis] + ".svg"),
                          section_svg(section));
  write_text_atomically(folder / "report.html", report_page(source, measures));
  write_text_atomically(folder / "metrics.json", json + "\n");
}

/// A run of `roxel sky`: there is nothing to measure but the light.
int run_eval_sky(const Invocation& invocation, const EvalOptions& options, Session& session) {
  const fs::path run = invocation.inputs.front();
  const std::string dataset = read_from_summary(
      run, [&] { return read_summary(run).value("/dataset/path"_json_pointer, std::string()); });
  const fs::path truth = options.truth.truth.value_or(options.truth.dataset.value_or(dataset));
  if (truth.empty() || !has_sky_truth(truth))
    throw_invalid("--truth " + truth.string(), "no illumination.json in it", "the true light of the nodes");
  RunMeasures measures;
  measures.run = run.string();
  measures.truth = truth.string();
  measures.skies = measure_skies(run, truth, session.context().thread_count());
  if (measures.skies.empty())
    throw_invalid((truth / "illumination.json").string(), "no node of the run",
                  "nodes named as in " + run.string());
  const std::string json =
      json_text({{"run", measures.run}, {"truth", truth.string()}, {"skies", to_json(measures.skies)}});
  if (!invocation.output.empty()) {
    protect_sources(invocation.output, {{run, truth}});
    const OutputFolder folder(invocation.output);
    PartialResults partial(folder.path());
    write_text_atomically(partial.path() / "skies.csv", csv_table(measures.skies));
    write_text_atomically(partial.path() / "metrics.json", json + "\n");
    partial.publish([&] { remove_older_measures(folder.path()); });
  }
  session.display().clear();
  print_result(options.common, to_text(measures), json);
  return 0;
}

int run_eval(const Invocation& invocation, const EvalOptions& options) {
  Session session(options.common);
  const fs::path path = invocation.inputs.front();
  if (!fs::exists(path / "volume.vdb") && fs::is_directory(path / "sky"))
    return run_eval_sky(invocation, options, session);
  const MeasureOptions wanted = measure_options(options.measures);
  const EvalSource source = read_eval_source(
      {invocation.inputs.front(), options.truth.truth, options.truth.dataset, options.measures.estimate},
      session);
  std::optional<OutputFolder> folder;
  if (!invocation.output.empty()) {
    protect_sources(invocation.output, sources_of(source));
    folder.emplace(invocation.output);
  }
  const RunMeasures measures = measure(source, wanted, session);
  check_measured(options, measures);
  const std::string json = json_text(to_json(measures));
  if (folder) {
    PartialResults partial(folder->path());
    write_files(partial.path(), source, measures, json);
    partial.publish([&] { remove_older_measures(folder->path()); });
  }
  session.display().clear();
  print_result(options.common, to_text(measures), json);
  return 0;
}

}  // namespace

void add_eval(Commands& commands) {
  CommandForm form{"eval", "Measure a run: against the truth, and renders against photographs", "RUN", "DIR"};
  form.output_required = false;
  form.details =
      "Prints tables, and writes metrics.json, CSV tables, plots and report.html to DIR with -o.\n";
  add_command(commands, form, eval_table(), run_eval);
}

}  // namespace roxel::cli

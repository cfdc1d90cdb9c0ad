/// roxel merge: joins the volumes of several runs.

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "command.h"
#include "common.h"
#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/io/voxels_ply.h"
#include "roxel/report/run_record.h"
#include "roxel/volume/merge.h"

namespace roxel::cli {
namespace {

struct MergeCommandOptions {
  std::optional<double> opacity_threshold;
  CommonOptions common;
};

OptionTable<MergeCommandOptions> merge_table() {
  OptionTable<MergeCommandOptions> table;
  table.group("Merged volume");
  table.add("opacity-threshold", &MergeCommandOptions::opacity_threshold)
      .help("Voxels below this opacity are left out of voxels.ply")
      .range(0, 0.999)
      .unset("that of the first run");
  table.include(common_option_table(), &MergeCommandOptions::common);
  return table;
}

/// Throws unless `what` of a run is that of the first.
void expect_same(const FinishedRun& run, const FinishedRun& first, const std::string& what,
                 const std::string& found, const std::string& expected) {
  if (found != expected)
    throw_invalid(run.path.string(), what + " " + found, expected + " as " + first.path.string() + " has");
}

std::string option_text(const FinishedRun& run, const char* name) { return run.option(name).dump(); }

std::string exact(double value) { return nlohmann::json(value).dump(); }

void check_compatible(const std::vector<FinishedRun>& runs) {
  const FinishedRun& first = runs.front();
  for (const FinishedRun& run : runs) {
    const VolumeInfo& info = run.file.info;
    const VolumeInfo& expected = first.file.info;
    expect_same(run, first, "colour space", to_string(info.colors.space()),
                to_string(expected.colors.space()));
    expect_same(run, first, "white point", to_string(info.colors.white()),
                to_string(expected.colors.white()));
    expect_same(run, first, "exposure", exact(info.exposure), exact(expected.exposure));
    for (const char* name : {"update", "prior-strength"})
      expect_same(run, first, std::string("option ") + name, option_text(run, name),
                  option_text(first, name));
  }
}

MergeOptions merge_options(const FinishedRun& run) {
  MergeOptions options;
  options.rule = run.option("update") == "roxels" ? SupportRule::kRoxels : SupportRule::kPosterior;
  if (run.option("prior-strength").is_number())
    options.prior_strength = run.option("prior-strength").get<double>();
  return options;
}

/// Hashes of the photographs that a run was made from, itself or merged from others.
std::set<std::string> photographs_of(const FinishedRun& run) {
  std::set<std::string> hashes;
  const auto list = [](const nlohmann::json& json, const char* key) {
    return json.value(key, nlohmann::json::array());
  };
  for (const nlohmann::json& view : list(run.summary, "views"))
    if (view.contains("hash") && view["hash"].is_string()) hashes.insert(view["hash"].get<std::string>());
  for (const nlohmann::json& source : list(run.summary, "merged_from"))
    for (const nlohmann::json& hash : list(source, "photographs")) hashes.insert(hash.get<std::string>());
  return hashes;
}

/// Whether the voxels of two runs can lie at the same places.
bool boxes_overlap(const FinishedRun& a, const FinishedRun& b) {
  const LatticeFrame &first = a.file.volume.index(0).frame(), &second = b.file.volume.index(0).frame();
  const Eigen::AlignedBox3d common = first.box().intersection(second.box());
  return (common.sizes().array() > 0.5 * first.voxel_size).all();
}

/// Photographs that two runs of overlapping boxes have in common: their evidence is summed twice.
std::vector<std::string> repeated_evidence(const std::vector<FinishedRun>& runs) {
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < runs.size(); ++i)
    for (std::size_t j = i + 1; j < runs.size(); ++j) {
      if (!boxes_overlap(runs[i], runs[j])) continue;
      const std::set<std::string> first = photographs_of(runs[i]), second = photographs_of(runs[j]);
      const auto common = std::count_if(first.begin(), first.end(),
                                        [&](const std::string& hash) { return second.contains(hash); });
      if (common > 0)
        warnings.push_back(runs[i].path.string() + " and " + runs[j].path.string() + ": " +
                           std::to_string(common) +
                           " photographs are in both, and count twice where the boxes overlap; expected "
                           "boxes side by side, or other photographs");
    }
  return warnings;
}

/// The first run's summary, less what was true of that run alone.
nlohmann::ordered_json merged_summary(const Invocation& invocation, const std::vector<FinishedRun>& runs,
                                      const std::vector<std::string>& warnings, const Volume& volume) {
  nlohmann::ordered_json summary = runs.front().summary;
  nlohmann::ordered_json sources = nlohmann::ordered_json::array();
  for (const FinishedRun& run : runs)
    sources.push_back({{"run", run.path.string()},
                       {"dataset", run.summary.value("dataset", nlohmann::json())},
                       {"photographs", photographs_of(run)}});
  for (const char* key : {"levels", "passes", "stages", "notes", "views"})
    summary[key] = nlohmann::ordered_json::array();
  summary["warnings"] = warnings;
  summary["command"] = invocation.line;
  summary["termination"] = "merged";
  summary["reprojection_rms_percent"] = nullptr;
  summary["merged_from"] = sources;
  summary["voxels_in_box"] = volume.box_slot_count();
  const LatticeFrame& frame = volume.index(0).frame();
  const Eigen::Vector3d low = frame.box().min(), high = frame.box().max();
  const Eigen::Vector3i voxels = frame.size_in_voxels();
  summary["scene"]["bounds"] = {low.x(), low.y(), low.z(), high.x(), high.y(), high.z()};
  summary["scene"]["bounds_from"] = "merged runs";
  summary["scene"]["lattice_origin"] = {low.x(), low.y(), low.z()};
  summary["scene"]["lattice_voxels"] = {voxels.x(), voxels.y(), voxels.z()};
  summary["scene"]["surround_lattices"] = volume.lattice_count() - 1;
  return summary;
}

/// What the run used for an option that is a number.
float used_number(const FinishedRun& run, const char* option) {
  const nlohmann::json& used = run.option(option);
  return used.is_number() ? used.get<float>() : 0;
}

std::vector<FinishedRun> read_runs(const std::vector<std::string>& paths, const RunContext& context) {
  std::vector<FinishedRun> runs;
  for (const std::string& path : paths) {
    runs.push_back(read_run(path));
    context.throw_if_cancelled();
  }
  return runs;
}

/// A run that is given twice would count twice.
void refuse_repeats(const std::vector<std::string>& runs) {
  std::set<std::filesystem::path> seen;
  for (const std::string& run : runs)
    if (!seen.insert(std::filesystem::weakly_canonical(run)).second)
      throw InvalidInput("merge: " + run + ": given twice, expected each run once");
}

int run_merge(const Invocation& invocation, const MergeCommandOptions& options) {
  if (invocation.inputs.size() < 2) throw InvalidInput("merge: found 1 run, expected at least 2");
  refuse_repeats(invocation.inputs);
  Session session(options.common);
  const std::vector<FinishedRun> runs = read_runs(invocation.inputs, session.context());
  check_compatible(runs);
  Sources sources;
  for (const FinishedRun& run : runs) sources.folders.push_back(run.path);
  protect_sources(invocation.output, sources);
  const OutputFolder folder(invocation.output);
  const std::vector<std::string> warnings = repeated_evidence(runs);
  for (const std::string& warning : warnings) warn(options.common, warning);
  std::vector<const Volume*> volumes;
  for (const FinishedRun& run : runs) volumes.push_back(&run.file.volume);
  const Volume merged = merge(volumes, merge_options(runs.front()), session.context().thread_count());
  session.context().throw_if_cancelled();
  PartialResults results(folder.path());
  const VolumeInfo& info = runs.front().file.info;
  write_volume(results.path() / "volume.vdb", merged, info, SavedLattices::kAll);
  write_voxels_ply(
      results.path() / "voxels.ply", merged, info.colors,
      static_cast<float>(options.opacity_threshold.value_or(used_number(runs.front(), "opacity-threshold"))),
      used_number(runs.front(), "confidence-threshold"));
  session.context().throw_if_cancelled();
  const std::string json = json_text(merged_summary(invocation, runs, warnings, merged));
  write_text_atomically(results.path() / "summary.json", json + "\n");
  session.context().throw_if_cancelled();
  results.publish([&] { remove_results(folder.path()); });
  print_result(options.common,
               std::to_string(runs.size()) + " runs, " + std::to_string(merged.box_slot_count()) +
                   " voxels, written to " + invocation.output.string() + "\n",
               json);
  return 0;
}

}  // namespace

void add_merge(Commands& commands) {
  CommandForm form{"merge", "Join the volumes of several runs", "RUN...", "RUN"};
  form.details =
      "Runs of neighbouring boxes, or of the same box from other photographs, with voxels of one size on\n"
      "one lattice. Their last passes' sums are added up as if they were one pass's; each run has compared\n"
      "its photographs with its own colours, so one run over all of them may come to other opacities.\n";
  add_command(commands, form, merge_table(), run_merge);
}

}  // namespace roxel::cli

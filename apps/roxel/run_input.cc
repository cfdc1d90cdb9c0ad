#include "run_input.h"

#include "roxel/base/error.h"
#include "roxel/solve/memory_plan.h"

namespace roxel::cli {

Input read_input_of(const FinishedRun& run, const std::optional<std::string>& dataset,
                    const Session& session) {
  const std::string path = dataset.value_or(run.file.info.dataset);
  if (path.empty() || !std::filesystem::exists(path))
    throw_invalid(
        run.path.string(), "a run whose data set \"" + path + "\" is not there",
        "photographs where the run has read them, or --dataset DATASET for roxel depth and roxel mesh");
  return read_input(path, input_options_of(run), session);
}

const OptionTable<MemoryOptions>& memory_option_table() {
  static const OptionTable<MemoryOptions> table = [] {
    OptionTable<MemoryOptions> made;
    made.group("Memory");
    made.add("memory", &MemoryOptions::memory)
        .help(
            "Keep to this much memory: fewer views are held at once, and a surface whose lattice does not "
            "fit "
            "is an error; results are the same")
        .unit("GiB")
        .above(0)
        .unset("what the machine has at hand");
    return made;
  }();
  return table;
}

std::int64_t bytes_left(const std::optional<double>& memory) {
  double left = memory_at_hand();
  if (memory) left = std::min(left, *memory * (std::int64_t{1} << 30) - resident_bytes());
  return static_cast<std::int64_t>(std::clamp(left, 0.0, 1e15));
}

Eigen::AlignedBox3d box_of(const FinishedRun& run) {
  const nlohmann::json bounds =
      run.summary.value("scene", nlohmann::json::object()).value("bounds", nlohmann::json());
  if (bounds.is_null()) return run.file.volume.index(0).frame().box();
  const auto v = bounds.get<std::vector<double>>();
  const bool fits = v.size() == 6 && v[0] < v[3] && v[1] < v[4] && v[2] < v[5];
  if (!fits)
    throw_invalid((run.path / "summary.json").string() + ": scene.bounds", bounds.dump(),
                  "six numbers, the first corner below the second");
  return {Eigen::Vector3d(v[0], v[1], v[2]), Eigen::Vector3d(v[3], v[4], v[5])};
}

InputOptions input_options_of(const FinishedRun& run) {
  InputOptions options;
  const auto text = [&](const char* name, auto& target) {
    if (const nlohmann::json& value = run.option(name); value.is_string()) target = value.get<std::string>();
  };
  text("format", options.format);
  text("images", options.images);
  text("nodes", options.nodes);
  if (const nlohmann::json& value = run.option("node-tolerance"); value.is_number())
    options.node_tolerance = value.get<double>();
  text("masks", options.masks);
  text("response", options.response);
  return options;
}

}  // namespace roxel::cli

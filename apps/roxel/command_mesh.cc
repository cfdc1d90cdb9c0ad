/// roxel mesh: the surface of a finished run, from its depth maps.

#include <fstream>
#include <nlohmann/json.hpp>

#include "command.h"
#include "mesh_stage.h"
#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "run_input.h"
#include "run_report.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

struct SourceOptions {
  std::optional<std::string> dataset;
};

struct MeshCommandOptions {
  SourceOptions source;
  MeshOptions mesh;
  MemoryOptions memory;
  CommonOptions common;
};

OptionTable<SourceOptions> source_table() {
  OptionTable<SourceOptions> table;
  table.group("Photographs of the run");
  table.add("dataset", &SourceOptions::dataset)
      .help("Where the run's photographs and cameras are now")
      .placeholder("DATASET")
      .unset("where the run has read them");
  return table;
}

OptionTable<MeshCommandOptions> mesh_table() {
  OptionTable<MeshCommandOptions> table;
  table.include(source_table(), &MeshCommandOptions::source);
  table.include(mesh_option_table(), &MeshCommandOptions::mesh);
  table.include(memory_option_table(), &MeshCommandOptions::memory);
  table.include(common_option_table(), &MeshCommandOptions::common);
  return table;
}

/// The run's summary and page tell of its newest mesh.
void renew_run(const FinishedRun& run, const Input& input, MeshResult result, const fs::path& results,
               const RunContext& context) {
  std::ifstream in(run.path / "summary.json");
  nlohmann::ordered_json summary = nlohmann::ordered_json::parse(in);
  summary["mesh"] = std::move(result.figures);
  if (has_report(run))
    write_run_report({run, input, {results, run.path}, summary}, std::move(result.pictures), context);
  write_text_atomically(results / "summary.json", json_text(summary) + "\n");
}

int run_mesh(const Invocation& invocation, const MeshCommandOptions& options) {
  Session session(options.common);
  const FinishedRun run = read_run(invocation.inputs.front());
  const Input input = read_input_of(run, options.source.dataset, session);
  const bool own_folder = invocation.output.empty();
  const fs::path target = own_folder ? run.path : invocation.output;
  if (!own_folder) protect_sources(target, {{run.path}, &input.dataset});
  const OutputFolder folder(target);
  PartialResults partial(folder.path());
  const MeshInput source{input.dataset, input.load, run.file.volume,      run.file.info,
                         box_of(run),   run.path,   options.memory.memory};
  MeshResult result = make_mesh(source, options.mesh, partial.path(), session.context());
  result.figures["options"] = mesh_option_table().to_json(options.mesh);
  const std::string figures = json_text(result.figures);
  if (own_folder) {
    renew_run(run, input, result, partial.path(), session.context());
  } else {
    write_text_atomically(partial.path() / "mesh.json", figures + "\n");
  }
  partial.publish_over(mesh_files());
  for (const std::string& warning : result.warnings) warn(options.common, warning);
  session.display().clear();
  print_result(options.common, result.text + "written to " + target.string() + "\n", figures);
  return 0;
}

}  // namespace

void add_mesh(Commands& commands) {
  CommandForm form{"mesh", "Make a run's surface from its depth maps: vertex colours and texture", "RUN",
                   "DIR"};
  form.output_required = false;
  form.details =
      "Writes mesh.ply (vertex colours), mesh.glb and mesh.obj (textured), mesh_views.png and "
      "mesh_turntable.jpg to\n"
      "RUN, and what it did to \"mesh\" in RUN/summary.json; or all to DIR, and mesh.json, with -o.\n";
  add_command(commands, form, mesh_table(), run_mesh);
}

}  // namespace roxel::cli

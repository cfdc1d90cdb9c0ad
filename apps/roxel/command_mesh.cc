/// roxel mesh: the surface of a finished run, from its depth maps.

#include <nlohmann/json.hpp>

#include "command.h"
#include "mesh_stage.h"
#include "roxel/base/error.h"
#include "run_input.h"

namespace roxel::cli {
namespace {

struct MeshCommandOptions {
  std::optional<std::string> dataset;
  MeshOptions mesh;
  CommonOptions common;
};

OptionTable<MeshCommandOptions> mesh_table() {
  OptionTable<MeshCommandOptions> table;
  table.group("Photographs of the run");
  table.add("dataset", &MeshCommandOptions::dataset)
      .help("Where the run's photographs and cameras are now")
      .placeholder("DATASET")
      .unset("where the run has read them");
  table.include(mesh_option_table(), &MeshCommandOptions::mesh);
  table.include(common_option_table(), &MeshCommandOptions::common);
  return table;
}

int run_mesh(const Invocation& invocation, const MeshCommandOptions& options) {
  Session session(options.common);
  const FinishedRun run = read_run(invocation.inputs.front());
  const std::string path = options.dataset.value_or(run.file.info.dataset);
  if (path.empty()) throw_invalid(run.path.string(), "a run that names no data set", "--dataset DATASET");
  const Input input = read_input(path, input_options_of(run), session);
  make_mesh({input.dataset, input.load, run.file, box_of(run), run.path}, options.mesh,
            invocation.output.empty() ? run.path : invocation.output, session);
  session.display().clear();
  return 0;
}

}  // namespace

void add_mesh(Commands& commands) {
  CommandForm form{"mesh", "Make a run's surface from its depth maps", "RUN", "DIR"};
  form.output_required = false;
  add_command(commands, form, mesh_table(), run_mesh);
}

}  // namespace roxel::cli

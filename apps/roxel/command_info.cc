/// roxel info: what was read, and what a reconstruction of it would be like.

#include "command.h"
#include "describe.h"

namespace roxel::cli {
namespace {

struct InfoOptions {
  ReconstructOptions reconstruct;
  DepthStageOptions depth;
  InputOptions input;
  CommonOptions common;
};

OptionTable<InfoOptions> info_table() {
  OptionTable<InfoOptions> table;
  table.include(input_option_table(), &InfoOptions::input);
  table.include(reconstruct_option_table(), &InfoOptions::reconstruct);
  table.include(depth_option_table(), &InfoOptions::depth);
  table.include(common_option_table(), &InfoOptions::common);
  return table;
}

int run_info(const Invocation& invocation, const InfoOptions& options) {
  Session session(options.common);
  const Input input = read_input(invocation.inputs.front(), options.input, session);
  const Description description = describe(input, options.reconstruct, options.depth, session.context());
  print_result(options.common, description.text, json_text(description.json));
  return 0;
}

}  // namespace

void add_info(Commands& commands) {
  CommandForm form{"info", "Say what a data set holds and what reconstructing it would cost; writes nothing",
                   "DATASET"};
  form.details = "Takes the options of reconstruct, so that memory and time are for that run.\n";
  add_command(commands, form, info_table(), run_info);
}

}  // namespace roxel::cli

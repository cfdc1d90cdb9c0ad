/// roxel synth: synthetic data sets with ground truth.

#include <cstdio>
#include <nlohmann/json.hpp>

#include "command.h"
#include "common.h"
#include "roxel/base/error.h"
#include "roxel/io/image_file.h"
#include "roxel/synth/demo_world.h"

namespace roxel::cli {
namespace {

struct SynthOptions {
  DemoWorldOptions world;
  std::string size = "320x240";
  CommonOptions common;
};

/// "WxH" to the world's width and height; nothing where it is something else.
bool parse_size(const std::string& text, int& width, int& height) {
  char rest = 0;
  return std::sscanf(text.c_str(), "%9dx%9d%c", &width, &height, &rest) == 2;
}

OptionTable<SynthOptions> synth_table() {
  OptionTable<SynthOptions> table;
  table.group("World");
  table.add("images", [](SynthOptions& o) -> int& { return o.world.images; })
      .help("Photographs, on three rings around the world")
      .range(2, 999);
  table.add("size", &SynthOptions::size)
      .help("Size of a photograph")
      .unit("pixels")
      .placeholder("WxH")
      .check("WIDTHxHEIGHT, each 16 to 16384", [](const OptionValue& value) {
        int width = 0, height = 0;
        return parse_size(std::get<std::string>(value), width, height) && width >= 16 && height >= 16 &&
               width <= 16384 && height <= 16384;
      });
  table.add("seed", [](SynthOptions& o) -> std::uint32_t& { return o.world.seed; })
      .help("Moves what stands in the world, and changes its textures");
  table
      .add("background", [](SynthOptions& o) -> DemoBackground& { return o.world.background; },
           {{"black", DemoBackground::kBlack}, {"sky", DemoBackground::kSky}})
      .help("What is behind the world");
  table.include(common_option_table(), &SynthOptions::common);
  return table;
}

DemoWorldWriters writers() {
  DemoWorldWriters to;
  to.photograph = [](const std::filesystem::path& path, const Image& rgb) { write_png(path.string(), rgb); };
  to.mask = [](const std::filesystem::path& path, const Mask& mask) { write_png(path.string(), mask); };
  to.depth = [](const std::filesystem::path& path, const Image& depth) {
    write_exr(path.string(), {{"Z", depth}});
  };
  return to;
}

int run_synth(const Invocation& invocation, const SynthOptions& options) {
  const std::string& name = invocation.inputs.front();
  if (name != "demo") throw_invalid("world", "\"" + name + "\"", "demo");
  DemoWorldOptions world = options.world;
  parse_size(options.size, world.width, world.height);
  Session session(options.common);
  const OutputFolder folder(invocation.output);
  write_demo_world(invocation.output, world, writers(), session.context());
  session.display().clear();
  const nlohmann::ordered_json json{{"world", name},
                                    {"dataset", invocation.output.string()},
                                    {"images", world.images},
                                    {"size", {world.width, world.height}},
                                    {"seed", world.seed}};
  print_result(options.common,
               std::to_string(world.images) + " photographs with cameras, masks and true depth written to " +
                   invocation.output.string() + "\n",
               json_text(json));
  return 0;
}

}  // namespace

void add_synth(Commands& commands) {
  CommandForm form{"synth", "Make photographs of a synthetic world, with exact cameras, masks and true depth",
                   "WORLD", "DATASET"};
  form.details = "Worlds: demo.\n";
  add_command(commands, form, synth_table(), run_synth);
}

}  // namespace roxel::cli

/// roxel synth: synthetic data sets with ground truth.

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "command.h"
#include "common.h"
#include "roxel/base/error.h"
#include "roxel/io/image_file.h"
#include "roxel/synth/dataset_text.h"
#include "roxel/synth/demo_world.h"
#include "roxel/synth/world_writer.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

enum class BackgroundChoice { kAuto, kBlack, kSky };
enum class LightChoice { kAuto, kConstant, kDaylight, kOvercast, kMix };

struct CommandOptions {
  SynthOptions world;
  std::optional<std::string> size;
  BackgroundChoice background = BackgroundChoice::kAuto;
  LightChoice light = LightChoice::kAuto;
  std::array<double, 2> pose_noise = {0, 0};
  CommonOptions common;
};

/// "WxH" to a width and a height; false where it is something else.
bool parse_size(const std::string& text, int& width, int& height) {
  char rest = 0;
  return std::sscanf(text.c_str(), "%9dx%9d%c", &width, &height, &rest) == 2;
}

bool is_size(const OptionValue& value) {
  int width = 0, height = 0;
  return parse_size(std::get<std::string>(value), width, height) && width >= 16 && height >= 16 &&
         width <= 16384 && height <= 16384;
}

void add_world_options(OptionTable<CommandOptions>& table) {
  table.group("World");
  table.add("images", [](CommandOptions& o) -> std::optional<int>& { return o.world.images; })
      .help("Photographs")
      .range(2, 999)
      .unset("the world's own");
  table.add("size", &CommandOptions::size)
      .help("Size of a photograph")
      .unit("pixels")
      .placeholder("WxH")
      .unset("the world's own")
      .check("WIDTHxHEIGHT, each 16 to 16384", is_size);
  table.add("seed", [](CommandOptions& o) -> std::uint32_t& { return o.world.seed; })
      .help("Changes textures, clutter, weather and noise");
  table
      .add("background", &CommandOptions::background,
           {{"auto", BackgroundChoice::kAuto},
            {"black", BackgroundChoice::kBlack},
            {"sky", BackgroundChoice::kSky}})
      .help("What is behind the world; auto: its own");
  table.add("samples", [](CommandOptions& o) -> std::optional<int>& { return o.world.samples; })
      .help("Light paths a pixel; more are slower and less grainy (not for demo)")
      .range(1, 4096)
      .unset("the world's own");
}

void add_trouble_options(OptionTable<CommandOptions>& table) {
  table.group("Light and trouble (not for demo)");
  table
      .add("light", &CommandOptions::light,
           {{"auto", LightChoice::kAuto},
            {"constant", LightChoice::kConstant},
            {"daylight", LightChoice::kDaylight},
            {"overcast", LightChoice::kOvercast},
            {"mix", LightChoice::kMix}})
      .help(
          "One light for all, or each occasion's own: clear, under cloud, or both in turn; auto: the world's "
          "own");
  table.add("moving-shadows", [](CommandOptions& o) -> bool& { return o.world.moving_shadows; })
      .help("Occasions have dates and times of their own, so that the sun moves");
  table.add("transients", [](CommandOptions& o) -> int& { return o.world.transients; })
      .help("Things that stand in the world at one occasion only, for each occasion")
      .range(0, 1000);
  table.add("noise", [](CommandOptions& o) -> double& { return o.world.noise; })
      .help("Standard deviation of photon noise at display white; light is then rounded to 12 bits; 0 = none")
      .range(0, 1);
  table.add("pose-noise", &CommandOptions::pose_noise)
      .help("Standard deviations of errors in the cameras that are written: degrees, world units")
      .range(0, 90);
}

OptionTable<CommandOptions> synth_table() {
  OptionTable<CommandOptions> table;
  add_world_options(table);
  add_trouble_options(table);
  table.include(common_option_table(), &CommandOptions::common);
  return table;
}

std::optional<bool> seen_background(BackgroundChoice choice) {
  if (choice == BackgroundChoice::kAuto) return std::nullopt;
  return choice == BackgroundChoice::kSky;
}

std::optional<LightKind> light_kind(LightChoice choice) {
  switch (choice) {
    case LightChoice::kConstant:
      return LightKind::kConstant;
    case LightChoice::kDaylight:
      return LightKind::kDaylight;
    case LightChoice::kOvercast:
      return LightKind::kOvercast;
    case LightChoice::kMix:
      return LightKind::kMix;
    case LightChoice::kAuto:
      break;
  }
  return std::nullopt;
}

void write_depth(const fs::path& path, const Image& depth) { write_exr(path.string(), {{"Z", depth}}); }
void write_picture(const fs::path& path, const Image& rgb) { write_png(path.string(), rgb); }
void write_grey(const fs::path& path, const Mask& mask) { write_png(path.string(), mask); }
void write_radiance(const fs::path& path, const Image& rgb) {
  write_exr(path.string(), rgb_channels(rgb), ExrPrecision::kHalf);
}

void print_made(const Invocation& invocation, const CommandOptions& options, const std::string& text,
                nlohmann::ordered_json json) {
  json["world"] = invocation.inputs.front();
  json["dataset"] = invocation.output.string();
  json["seed"] = options.world.seed;
  print_result(options.common, text + " written to " + invocation.output.string() + "\n", json_text(json));
}

/// The demo has none of these; an option that does nothing is an error.
void refuse_for_demo(const CommandOptions& options) {
  const SynthOptions& w = options.world;
  const char* name = w.samples                             ? "samples"
                     : options.light != LightChoice::kAuto ? "light"
                     : !w.moving_shadows                   ? "moving-shadows"
                     : w.transients > 0                    ? "transients"
                     : w.noise > 0                         ? "noise"
                     : w.pose_noise.any()                  ? "pose-noise"
                                                           : nullptr;
  if (name) throw_invalid(std::string("--") + name, "world demo", "another world; the demo does not have it");
}

/// What transforms.json in a folder holds; null where there is none or it cannot be read.
nlohmann::json older_data_set(const fs::path& folder) {
  std::ifstream in(folder / "transforms.json");
  return in ? nlohmann::json::parse(in, nullptr, false) : nlohmann::json();
}

/// What a data set of this command consists of, besides transforms.json.
constexpr const char* kParts[] = {"images", "mask",   "depth",     "albedo",   "normal",
                                  "sky",    "sparse", "transient", "mesh.ply", "illumination.json"};

/// Only what this command has made may be replaced: photographs cannot be made again.
void check_older(const fs::path& folder) {
  const nlohmann::json older = older_data_set(folder);
  if (older.is_object() && older.value("generator", nlohmann::json()) == kSyntheticGenerator) return;
  const bool taken = fs::exists(folder / "transforms.json") ||
                     std::any_of(std::begin(kParts), std::end(kParts),
                                 [&](const char* part) { return fs::exists(folder / part); });
  if (taken) throw_invalid(folder.string(), "files that roxel synth did not make", "another folder");
}

/// Removes a file that an older data set names, and the folder that it leaves empty.
void remove_named(const fs::path& folder, const nlohmann::json& name) {
  if (!name.is_string()) return;
  const fs::path path = fs::path(name.get<std::string>()).lexically_normal();
  if (path.empty() || !path.is_relative() || *path.begin() == "..") return;
  std::error_code ignored;
  fs::remove(folder / path, ignored);
  const fs::path above = (folder / path).parent_path();
  if (above != folder && fs::is_empty(above, ignored)) fs::remove(above, ignored);
}

/// Files of an older synthetic data set, so that none is left over beside the new one.
void remove_older_data_set(const fs::path& folder) {
  const nlohmann::json older = older_data_set(folder);
  std::ifstream in(folder / "illumination.json");
  const nlohmann::json light = in ? nlohmann::json::parse(in, nullptr, false) : nlohmann::json();
  if (older.is_object() && older.contains("frames"))
    for (const auto& frame : older["frames"])
      for (const auto& [key, value] : frame.items())
        if (key.ends_with("_path")) remove_named(folder, value);
  if (light.is_object() && light.contains("nodes"))
    for (const auto& node : light["nodes"])
      for (const char* map : {"equirect", "equirect_without_disc"})
        if (node.contains(map)) remove_named(folder, node[map]);
  for (const char* name : {"transforms.json", "transforms_true.json", "illumination.json", "mesh.ply"})
    remove_named(folder, name);
}

/// Options that would do nothing in this world are errors.
void refuse_without_effect(const CommandOptions& options, WorldKind world) {
  const LightKind light = options.world.light.value_or(world_defaults(world).light);
  if (!options.world.moving_shadows && light == LightKind::kConstant)
    throw_invalid("--no-moving-shadows", "constant light", "--light daylight, overcast or mix");
  if (options.background != BackgroundChoice::kAuto && world == WorldKind::kTable)
    throw_invalid("--background", "world table", "another world; the room hides what is behind it");
}

int run_demo(const Invocation& invocation, const CommandOptions& options, const fs::path& folder,
             Session& session) {
  DemoWorldOptions world;
  world.images = options.world.images.value_or(world.images);
  world.width = options.world.width.value_or(world.width);
  world.height = options.world.height.value_or(world.height);
  world.seed = options.world.seed;
  if (options.background == BackgroundChoice::kSky) world.background = DemoBackground::kSky;
  PartialResults results(folder);
  write_demo_world(results.path(), world, {write_picture, write_grey, write_depth}, session.context());
  results.publish([&] { remove_older_data_set(folder); });
  session.display().clear();
  print_made(invocation, options,
             std::to_string(world.images) + " photographs with cameras, masks and true depth",
             {{"images", world.images}, {"size", {world.width, world.height}}});
  return 0;
}

int run_synth(const Invocation& invocation, const CommandOptions& given) {
  CommandOptions options = given;
  const std::string& name = invocation.inputs.front();
  const auto world = find_world(name);
  if (!world && name != "demo")
    throw_invalid("world", "\"" + name + "\"", "demo, plane, head, mug, table, street or flights");
  int width = 0, height = 0;
  if (options.size && parse_size(*options.size, width, height)) {
    options.world.width = width;
    options.world.height = height;
  }
  options.world.pose_noise = {options.pose_noise[0], options.pose_noise[1]};
  options.world.environment_seen = seen_background(options.background);
  options.world.light = light_kind(options.light);

  Session session(options.common);
  if (world)
    refuse_without_effect(options, *world);
  else
    refuse_for_demo(options);
  check_older(invocation.output);
  const OutputFolder folder(invocation.output);
  if (!world) return run_demo(invocation, options, folder.path(), session);
  const WorldWriters writers{write_picture, write_grey, write_radiance, write_depth};
  PartialResults results(folder.path());
  const SynthSummary made = write_world(results.path(), *world, options.world, writers, session.context());
  results.publish([&] { remove_older_data_set(folder.path()); });
  session.display().clear();
  print_made(
      invocation, options,
      std::to_string(made.images) + " photographs with cameras, depth, albedo, normals, light and mesh",
      {{"images", made.images},
       {"size", {made.width, made.height}},
       {"occasions", made.occasions},
       {"triangles", made.triangles},
       {"points", made.points}});
  return 0;
}

}  // namespace

void add_synth(Commands& commands) {
  CommandForm form{"synth",
                   "Make photographs of a synthetic world, with exact cameras and the truth about them",
                   "WORLD", "DATASET"};
  form.details =
      "Worlds: demo    a temple on an island\n"
      "        plane   a printed board\n"
      "        head    a head on a turntable, partly plain\n"
      "        mug     a hollow mug with a handle on a turntable\n"
      "        table   a still life in a room, seen beyond the box\n"
      "        street  an urban block, twenty photographs from each of several nodes, at different times\n"
      "        flights the same block from the air, three flights at different times\n";
  add_command(commands, form, synth_table(), run_synth);
}

}  // namespace roxel::cli

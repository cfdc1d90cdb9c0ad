/// roxel render: a finished run's volume from any calibrated cameras.

#include <nlohmann/json.hpp>

#include "command.h"
#include "common.h"
#include "roxel/base/error.h"
#include "roxel/io/image_file.h"
#include "roxel/report/pictures.h"
#include "roxel/report/run_record.h"
#include "run_renderer.h"

namespace roxel::cli {
namespace {

struct RenderCommandOptions {
  std::optional<std::string> cameras;
  std::optional<std::array<double, 3>> background_color;
  bool surround = true;
  InputOptions input;
  CommonOptions common;
};

OptionTable<RenderCommandOptions> render_table() {
  OptionTable<RenderCommandOptions> table;
  table.group("View");
  table.add("cameras", &RenderCommandOptions::cameras)
      .help("Data set whose cameras are rendered from")
      .placeholder("DATASET")
      .unset("the run's own");
  table.add("background-color", &RenderCommandOptions::background_color)
      .help("Linear r,g,b where rays leave the volume")
      .unset("that of the run where it is known, else black");
  table.add("surround", &RenderCommandOptions::surround)
      .help("Show voxels around the box, where the volume has them");
  table.include(input_option_table(), &RenderCommandOptions::input);
  table.include(common_option_table(), &RenderCommandOptions::common);
  return table;
}

void write_pictures(const std::filesystem::path& folder, const std::string& name,
                    const Rendering& rendering) {
  write_png(view_path(folder, "render", name, ".png").string(), encoded_picture(rendering.rgb, 1, {}),
            kAsItIs);
  write_png(
      view_path(folder, "depth", name, ".png").string(),
      depth_picture(rendering.depth, rendering.opacity, shown_depths(rendering.depth, rendering.opacity)),
      kAsItIs);
  write_png(view_path(folder, "opacity", name, ".png").string(), rendering.opacity, kAsItIs);
}

/// Colours as radiance, depth and opacity as numbers.
void write_planes(const std::filesystem::path& folder, const std::string& name, const Rendering& rendering,
                  double exposure) {
  const int width = rendering.rgb.width(), height = rendering.rgb.height();
  std::vector<FloatChannel> channels;
  for (int c = 0; c < 3; ++c) {
    Image plane(width, height, 1);
    for (std::size_t i = 0; i < plane.data().size(); ++i)
      plane.data()[i] = rendering.rgb.data()[3 * i + c] * static_cast<float>(exposure);
    channels.push_back({std::string(1, "RGB"[c]), std::move(plane)});
  }
  channels.push_back({"A", rendering.opacity});
  channels.push_back({"Z", rendering.depth});
  write_exr(view_path(folder, "render", name, ".exr").string(), channels);
}

Input read_cameras(const FinishedRun& run, const RenderCommandOptions& options, const Session& session) {
  if (options.cameras) return read_input(*options.cameras, options.input, session);
  if (run.file.info.dataset.empty())
    throw_invalid(run.path.string(), "a run that names no data set", "--cameras DATASET");
  return read_input(run.file.info.dataset, options.input, session);
}

int run_render(const Invocation& invocation, const RenderCommandOptions& options) {
  Session session(options.common);
  const FinishedRun run = read_run(invocation.inputs.front());
  const Input input = read_cameras(run, options, session);
  protect_sources(invocation.output, {{run.path}, &input.dataset});
  const OutputFolder folder(invocation.output);
  const RunRenderer renderer(run, {options.background_color, options.surround});
  const std::vector<View>& views = input.dataset.views;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Rendering rendering = renderer(views[v], session.context());
    write_pictures(invocation.output, views[v].name, rendering);
    write_planes(invocation.output, views[v].name, rendering, run.file.info.exposure);
    session.context().throw_if_cancelled();
    Progress progress;
    progress.stage = "render";
    progress.fraction = static_cast<double>(v + 1) / static_cast<double>(views.size());
    session.context().report(progress);
  }
  session.display().clear();
  const nlohmann::ordered_json json{
      {"run", run.path.string()}, {"images", views.size()}, {"output", invocation.output.string()}};
  print_result(options.common,
               std::to_string(views.size()) + " views written to " + invocation.output.string() + "\n",
               json_text(json));
  return 0;
}

}  // namespace

void add_render(Commands& commands) {
  CommandForm form{"render", "Render a run's volume from any calibrated cameras: colour, depth, opacity",
                   "RUN", "DIR"};
  form.details =
      "Writes DIR/render/NAME.png, DIR/depth/NAME.png (false colour), DIR/opacity/NAME.png, and\n"
      "DIR/render/NAME.exr with the channels R, G, B (radiance), A (opacity), Z (distance along the axis).\n";
  add_command(commands, form, render_table(), run_render);
}

}  // namespace roxel::cli

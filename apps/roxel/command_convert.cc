/// roxel convert: a data set in another format, its images undistorted.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "command.h"
#include "common.h"
#include "dense_workspace.h"
#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/io/dataset_writer.h"
#include "roxel/io/image_file.h"
#include "roxel/report/run_record.h"
#include "run_input.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

enum class Target { kColmap, kTransforms, kColmapDense };

struct ConvertOptions {
  Target to = Target::kTransforms;
  InputOptions input;
  CommonOptions common;
};

OptionTable<ConvertOptions> convert_table() {
  OptionTable<ConvertOptions> table;
  table.group("Converted data set");
  table
      .add("to", &ConvertOptions::to,
           {{"transforms", Target::kTransforms},
            {"colmap", Target::kColmap},
            {"colmap-dense", Target::kColmapDense}})
      .help("Format of the result; colmap-dense: a run's depth and normals, for stereo_fusion");
  table.include(input_option_table(), &ConvertOptions::input);
  table.include(common_option_table(), &ConvertOptions::common);
  return table;
}

bool is_bright(const Image& rgb) {
  return std::any_of(rgb.data().begin(), rgb.data().end(), [](float value) { return value > 1.001f; });
}

/// Writes the view's pixels, and makes the view speak of them: a pinhole, other paths.
void write_view(const fs::path& folder, const PhotographLoader& load, View& view) {
  const Photograph photo = load(view);
  const bool high_range = is_bright(photo.rgb);
  const fs::path image = fs::absolute(view_path(folder, "images", view.name, high_range ? ".exr" : ".png"));
  if (high_range)
    write_exr(image.string(), rgb_channels(photo.rgb));
  else
    write_png(image.string(), photo.rgb);
  view.mask_path.clear();
  if (!photo.foreground.empty()) {
    const fs::path mask = fs::absolute(view_path(folder, "masks", view.name, ".png"));
    write_png(mask.string(), photo.foreground);
    view.mask_path = mask.string();
  }
  view.image_path = image.string();
  view.has_alpha = false;
  view.lens = Lens{};
  view.lens.intrinsics = view.camera.intrinsics;
}

/// The input is a run.
int convert_run(const Invocation& invocation, const ConvertOptions& options) {
  Session session(options.common);
  const FinishedRun run = read_run(invocation.inputs.front());
  const Input input = read_input_of(run, std::nullopt, session);
  protect_sources(invocation.output, {{run.path}, &input.dataset});
  const OutputFolder folder(invocation.output);
  PartialResults results(folder.path());
  write_dense_workspace(input.dataset, input.load, run.path, results.path(), run.file.info.exposure,
                        run.file.volume.index(0).frame().voxel_size, session.context());
  session.context().throw_if_cancelled();
  results.publish();
  session.display().clear();
  const nlohmann::ordered_json json{{"workspace", invocation.output.string()},
                                    {"images", input.dataset.views.size()}};
  print_result(options.common,
               "depth and normals of " + std::to_string(input.dataset.views.size()) + " images written to " +
                   invocation.output.string() + ", for COLMAP\n",
               json_text(json));
  return 0;
}

int run_convert(const Invocation& invocation, const ConvertOptions& options) {
  if (options.to == Target::kColmapDense) return convert_run(invocation, options);
  Session session(options.common);
  Input input = read_input(invocation.inputs.front(), options.input, session);
  protect_sources(invocation.output, {{}, &input.dataset});
  const OutputFolder folder(invocation.output);
  PartialResults results(folder.path());
  std::atomic<int> done{0};
  parallel_for(input.dataset.views.size(), session.context().thread_count(), [&](std::int64_t v, int) {
    session.context().throw_if_cancelled();
    write_view(results.path(), input.load, input.dataset.views[v]);
    Progress progress;
    progress.stage = "convert";
    progress.fraction = ++done / static_cast<double>(input.dataset.views.size());
    session.context().report(progress);
  });
  if (options.to == Target::kColmap)
    write_colmap_text(input.dataset, results.path());
  else
    write_transforms(input.dataset, results.path());
  session.context().throw_if_cancelled();
  results.publish();
  session.display().clear();
  const nlohmann::ordered_json json{{"dataset", invocation.output.string()},
                                    {"images", input.dataset.views.size()}};
  print_result(options.common,
               std::to_string(input.dataset.views.size()) +
                   " undistorted images and their cameras written to " + invocation.output.string() + "\n",
               json_text(json));
  return 0;
}

}  // namespace

void add_convert(Commands& commands) {
  CommandForm form{"convert",
                   "Write a data set, or a run's depth, in another format, with lens distortion undone",
                   "DATASET|RUN", "DATASET"};
  add_command(commands, form, convert_table(), run_convert);
}

}  // namespace roxel::cli

/// roxel convert: a data set in another format, its images undistorted.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "command.h"
#include "common.h"
#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/io/dataset_writer.h"
#include "roxel/io/image_file.h"
#include "roxel/report/run_record.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

enum class Target { kColmap, kTransforms };

struct ConvertOptions {
  Target to = Target::kTransforms;
  InputOptions input;
  CommonOptions common;
};

OptionTable<ConvertOptions> convert_table() {
  OptionTable<ConvertOptions> table;
  table.group("Converted data set");
  table.add("to", &ConvertOptions::to, {{"transforms", Target::kTransforms}, {"colmap", Target::kColmap}})
      .help("Format of the result");
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

int run_convert(const Invocation& invocation, const ConvertOptions& options) {
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
  CommandForm form{"convert", "Write a data set in another format, with lens distortion undone", "DATASET",
                   "DATASET"};
  add_command(commands, form, convert_table(), run_convert);
}

}  // namespace roxel::cli

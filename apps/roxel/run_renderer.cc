#include "run_renderer.h"

#include <limits>

#include "roxel/solve/run_stages.h"

namespace roxel::cli {
namespace {

/// What the volume leaves of a ray: the option, else the run's own known background. Linear, 1 = white.
std::array<float, 3> background(const FinishedRun& run, const RunRendererOptions& options) {
  std::array<float, 3> color{0, 0, 0};
  const nlohmann::json scene = run.summary.value("scene", nlohmann::json::object());
  const nlohmann::json known =
      scene.value("background", nlohmann::json::object()).value("color", nlohmann::json());
  for (int c = 0; c < 3; ++c) {
    if (known.is_array() && known.size() == 3 && known[c].is_number()) color[c] = known[c].get<float>();
    if (options.background_color) color[c] = static_cast<float>((*options.background_color)[c]);
  }
  return color;
}

}  // namespace

RunRenderer::RunRenderer(const FinishedRun& run, const RunRendererOptions& options)
    : stack_(run.file.volume), colors_(radiance_colors(run.file.volume, run.file.info.colors, 1)) {
  options_.background = read_from_summary(run.path, [&] { return background(run, options); });
  options_.surround = options.surround;
  options_.interpolate = !run.file.volume.fitted_color.empty();
}

Rendering RunRenderer::operator()(const View& view, const RunContext& context) const {
  const Stretch range{view.near.value_or(0), std::numeric_limits<double>::infinity()};
  return render(stack_, colors_, view.camera, range, options_, context);
}

}  // namespace roxel::cli

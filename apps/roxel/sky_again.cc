#include "sky_again.h"

#include <cmath>

#include "roxel/base/parallel.h"
#include "roxel/dataset/scaled_photograph.h"
#include "roxel/march/render.h"
#include "roxel/sky/sky_tasks.h"

namespace roxel::cli {
namespace {

constexpr float kUnexplained = 0.5f;  ///< opacity of a ray below which the volume does not explain it
constexpr double kHorizon = 0.02;     ///< sine of the elevation from which a ray may show sky
constexpr std::uint8_t kDoubt = 254;  ///< foreground of a pixel that may be sky: 0.4 % background

bool rises(const PinholeCamera& camera, const Eigen::Vector3d& up, int x, int y) {
  return camera.ray(x + 0.5, y + 0.5).direction.normalized().dot(up) > kHorizon;
}

}  // namespace

OpenRays open_rays(const Volume& volume, const Dataset& dataset, const Scene& scene,
                   const Eigen::Vector3d& up, const RunContext& context) {
  const LatticeStack stack(volume);
  const std::vector<std::array<float, 3>> colors(volume.slot_count(), {0, 0, 0});
  std::vector<Mask> masks(dataset.views.size());
  parallel_for(static_cast<std::int64_t>(masks.size()), context.thread_count(), [&](std::int64_t v, int) {
    context.throw_if_cancelled();
    const PinholeCamera camera = scaled(dataset.views[v].camera, sky_scale(dataset.views[v].camera));
    const Rendering seen =
        render(stack, colors, camera, view_range(scene, dataset, static_cast<int>(v)), {}, RunContext(1));
    Mask open(camera.intrinsics.width, camera.intrinsics.height, 0);
    for (int y = 0; y < open.height(); ++y)
      for (int x = 0; x < open.width(); ++x)
        if (*seen.opacity.pixel(x, y) < kUnexplained && rises(camera, up, x, y)) open.at(x, y) = 255;
    masks[v] = std::move(open);
  });
  OpenRays open;
  for (std::size_t v = 0; v < masks.size(); ++v) open[dataset.views[v].name] = std::move(masks[v]);
  return open;
}

PhotographLoader with_doubt(PhotographLoader load, const Eigen::Vector3d& up, std::set<std::string> names,
                            std::shared_ptr<const std::atomic<bool>> doubt) {
  return [load = std::move(load), up, names = std::move(names), doubt = std::move(doubt)](const View& view) {
    Photograph photo = load(view);
    if (!*doubt || !photo.foreground.empty() || !names.contains(view.name)) return photo;
    photo.foreground = Mask(photo.rgb.width(), photo.rgb.height());
    for (int y = 0; y < photo.rgb.height(); ++y)
      for (int x = 0; x < photo.rgb.width(); ++x)
        if (rises(view.camera, up, x, y)) photo.foreground.at(x, y) = kDoubt;
    return photo;
  };
}

nlohmann::ordered_json to_json(const SkyAgain& again) {
  return {{"node", again.node},
          {"unexplained_share", again.open_share},
          {"mask_share_before", again.mask_share_before},
          {"mask_share", again.mask_share},
          {"mean_error_before", again.error_before},
          {"mean_error", again.error},
          {"taken", again.refused.empty()},
          {"refused", again.refused}};
}

}  // namespace roxel::cli

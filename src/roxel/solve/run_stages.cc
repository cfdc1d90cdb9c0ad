#include "roxel/solve/run_stages.h"

#include <algorithm>
#include <atomic>

#include "roxel/base/parallel.h"
#include "roxel/solve/surface_paint.h"
#include "roxel/volume/shown_color.h"

namespace roxel {
namespace {

constexpr std::size_t kViewsAtOnce = 16;

/// Everything that the stages share, made once.
class ViewStages {
 public:
  ViewStages(const Dataset& dataset, const PhotographLoader& load, const Reconstruction& reconstruction,
             const ReconstructOptions& options, const ViewStageOptions& stages, RunContext& context)
      : dataset_(dataset),
        load_(load),
        scene_(reconstruction.scene),
        surface_light_(reconstruction.surface_light ? &*reconstruction.surface_light : nullptr),
        stages_(stages),
        context_(context),
        stack_(reconstruction.volume),
        pass_(pass_options(scene_, options)),
        collected_(stages.depth ? reconstruction.volume.slot_count() : 0, dataset.nodes.size(),
                   pass_.kept_color_bytes),
        scratch_(stages.depth ? roxel::worker_count(pass_, context) : context.thread_count()) {
    if (stages.render) colors_ = radiance_colors(reconstruction.volume, scene_.transform, scene_.exposure);
    if (!stages.depth) return;
    samples_ = make_samples(dataset, load, scene_, scene_.voxel_size, options, context);
    collect_color(stack_, samples_, pass_, context, nullptr, collected_);
  }

  int worker_count() const { return static_cast<int>(scratch_.size()); }

  void work_on_node(int node, int worker, const std::function<void(const ViewResult&)>& visit) {
    const std::vector<int>& views = dataset_.nodes[node].view_idxs;
    for (std::size_t begin = 0; begin < views.size(); begin += kViewsAtOnce) {
      const std::size_t end = std::min(begin + kViewsAtOnce, views.size());
      std::vector<ViewResult> results(end - begin);
      for (std::size_t i = begin; i < end; ++i) load_view(views[i], results[i - begin]);
      if (stages_.depth) add_depth(node, worker, results);
      for (ViewResult& result : results) {
        result.view_light = scene_.light.of_view(result.view_idx);
        if (stages_.render) {
          result.rendering = render_view(result.view_idx);
          put_into_light_of(result);
        }
        visit(result);
        report_one();
      }
    }
  }

 private:
  void load_view(int view_idx, ViewResult& result) const {
    context_.throw_if_cancelled();
    result.view_idx = view_idx;
    result.photo = load_(dataset_.views[view_idx]);
  }

  void add_depth(int node, int worker, std::vector<ViewResult>& results) {
    SampleNode full;
    for (const ViewResult& result : results)
      full.push_back(make_full_view(dataset_, result.view_idx, result.photo, scene_));
    if (!scratch_[worker]) scratch_[worker] = std::make_unique<NodeScratch>(stack_, stack_.volume().tau);
    scratch_[worker]->reset();
    compare_with_others(stack_, resident(samples_[node]), node, pass_, collected_, context_,
                        *scratch_[worker]);
    std::vector<DepthMap> maps =
        estimate_depth(stack_, full, pass_, stages_.depth_options, context_, *scratch_[worker]);
    for (std::size_t i = 0; i < maps.size(); ++i) results[i].depth = std::move(maps[i]);
  }

  RenderOptions render_options() const {
    RenderOptions options;
    options.background = background_radiance(scene_);
    options.interpolate = !stack_.volume().fitted_color.empty();
    return options;
  }

  Rendering render_view(int view_idx) const {
    std::vector<std::array<float, 3>> lit;
    return render(stack_, colors_for(view_idx, lit), dataset_.views[view_idx].camera,
                  view_range(scene_, dataset_, view_idx), render_options(), context_);
  }

  bool has_surface_light(int view_idx) const {
    return surface_light_ && surface_light_->sky_of_view(view_idx) >= 0;
  }

  /// Colours that the view is rendered with: in the light on their own surface where that is known, else
  /// canonical.
  const std::vector<std::array<float, 3>>& colors_for(int view_idx,
                                                      std::vector<std::array<float, 3>>& lit) const {
    if (!has_surface_light(view_idx)) return colors_;
    lit = in_light_of(*surface_light_, surface_light_->sky_of_view(view_idx), colors_);
    return lit;
  }

  /// Canonical colours as the view's photograph shows them.
  void put_into_light_of(ViewResult& result) const {
    if (has_surface_light(result.view_idx)) {
      const PinholeCamera& camera = dataset_.views[result.view_idx].camera;
      result.light = light_of_pixels(stack_, *surface_light_, surface_light_->sky_of_view(result.view_idx),
                                     camera, view_range(scene_, dataset_, result.view_idx), context_);
      return;
    }
    Image& rgb = result.rendering.rgb;
    for (std::size_t i = 0; i < rgb.data().size(); ++i) rgb.data()[i] *= result.view_light[i % 3];
  }

  void report_one() {
    Progress progress;
    progress.stage = stages_.depth ? "depth" : "render";
    const double share = static_cast<double>(++done_) / static_cast<double>(dataset_.views.size());
    progress.fraction = stages_.progress_begin + (stages_.progress_end - stages_.progress_begin) * share;
    context_.report(progress);
  }

  const Dataset& dataset_;
  const PhotographLoader& load_;
  const Scene& scene_;
  const SurfaceLight* surface_light_;
  const ViewStageOptions& stages_;
  RunContext& context_;
  LatticeStack stack_;
  PassOptions pass_;
  CollectedColors collected_;
  std::vector<SampleNode> samples_;
  std::vector<std::array<float, 3>> colors_;
  std::vector<std::unique_ptr<NodeScratch>> scratch_;
  std::atomic<int> done_{0};
};

}  // namespace

void for_each_view_result(const Dataset& dataset, const PhotographLoader& load,
                          const Reconstruction& reconstruction, const ReconstructOptions& options,
                          const ViewStageOptions& stages, RunContext& context,
                          const std::function<void(const ViewResult&)>& visit) {
  if (!stages.depth && !stages.render) return;
  ViewStages work(dataset, load, reconstruction, options, stages, context);
  parallel_for(dataset.nodes.size(), work.worker_count(), [&](std::int64_t node, int worker) {
    work.work_on_node(static_cast<int>(node), worker, visit);
  });
}

std::vector<std::array<float, 3>> radiance_colors(const Volume& volume, const ColorTransform& transform,
                                                  double exposure) {
  std::vector<std::array<float, 3>> colors(volume.slot_count());
  for (std::size_t slot = 0; slot < colors.size(); ++slot) {
    colors[slot] = shown_color(volume, transform, static_cast<std::uint32_t>(slot));
    for (float& value : colors[slot]) value *= static_cast<float>(exposure);
  }
  return colors;
}

std::array<float, 3> background_radiance(const Scene& scene) {
  std::array<float, 3> color{0, 0, 0};
  if (scene.background.kind != BackgroundKind::kKnown) return color;
  scene.transform.to_rgb(scene.background.mean, color.data());
  for (float& value : color) value = std::max(0.0f, value * static_cast<float>(scene.exposure));
  return color;
}

}  // namespace roxel

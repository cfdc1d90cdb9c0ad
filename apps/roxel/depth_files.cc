#include "depth_files.h"
#include "common.h"

#include <nlohmann/json.hpp>

#include "roxel/base/error.h"
#include "roxel/base/formatted.h"
#include "roxel/base/parallel.h"
#include "roxel/base/peak_memory.h"
#include "roxel/io/depth_file.h"
#include "roxel/io/image_file.h"
#include "roxel/io/kept_images.h"
#include "roxel/report/pictures.h"
#include "roxel/report/run_record.h"
#include "run_input.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr int kHeldShare = 2;  ///< views that refinement holds take one part in so many of what is left

/// What is put aside between the stage's passes: files of a folder that goes in the end.
class PutAside {
 public:
  PutAside(const fs::path& results, const Dataset& dataset)
      : folder_(results / kAsideFolder), dataset_(dataset), has_layers_(dataset.views.size(), 0) {}
  ~PutAside() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  PutAside(const PutAside&) = delete;
  PutAside& operator=(const PutAside&) = delete;

  void keep(int view_idx, const RefinedView& view) const {
    const PlaneMap& map = view.planes;
    Image planes(map.width, map.height, 3);
    for (std::size_t i = 0; i < map.planes.size(); ++i) {
      planes.data()[3 * i] = map.planes[i].w;
      planes.data()[3 * i + 1] = map.planes[i].wu;
      planes.data()[3 * i + 2] = map.planes[i].wv;
    }
    write_kept_images(file("planes", view_idx), {&planes, &view.variance, &view.shared, &view.correlation});
  }
  RefinedView recall(int view_idx) const {
    std::vector<Image> kept = read_kept_images(file("planes", view_idx));
    RefinedView view{PlaneMap(kept[0].width(), kept[0].height()), std::move(kept[1]), std::move(kept[2]),
                     std::move(kept[3])};
    for (std::size_t i = 0; i < view.planes.planes.size(); ++i) {
      const float* plane = &kept[0].data()[3 * i];
      view.planes.planes[i] = {plane[0], plane[1], plane[2]};
    }
    return view;
  }

  /// What is known before refinement.
  void keep(int view_idx, const DepthLayers& layers) {
    write_kept_images(file("layers", view_idx), {&layers.depth, &layers.variance, &layers.opacity,
                                                 &layers.depth_bp, &layers.variance_bp});
    has_layers_[view_idx] = 1;
  }
  bool has_layers(int view_idx) const { return has_layers_[view_idx] != 0; }
  DepthLayers recall_layers(int view_idx) const {
    std::vector<Image> kept = read_kept_images(file("layers", view_idx));
    return {std::move(kept[0]), std::move(kept[1]), std::move(kept[2]), std::move(kept[3]),
            std::move(kept[4])};
  }

 private:
  fs::path file(const char* kind, int view_idx) const {
    return view_path(folder_, kind, dataset_.views[view_idx].name, ".kept");
  }
  fs::path folder_;
  const Dataset& dataset_;
  std::vector<char> has_layers_;  ///< of each view; each is only ever worked on by one thread at a time
};

DepthLayers read_layers(const DepthFolders& folders, const View& view) {
  fs::path file = depth_path(folders.results, view.name);
  if (!fs::is_regular_file(file)) file = depth_path(folders.earlier, view.name);
  DepthLayers layers = read_depth(file);
  const Intrinsics& k = view.camera.intrinsics;
  if (layers.depth.width() != k.width || layers.depth.height() != k.height)
    throw_invalid(file.string(), formatted("%d x %d pixels", layers.depth.width(), layers.depth.height()),
                  formatted("%d x %d as %s has", k.width, k.height, view.source.c_str()));
  return layers;
}

/// That of the rays, at least one half where there is a depth that is believed.
Image opacity_of(const DepthLayers& layers, const Image& depth) {
  Image opacity = layers.opacity;
  for (std::size_t i = 0; i < opacity.data().size(); ++i)
    if (depth.data()[i] > 0) opacity.data()[i] = std::max(opacity.data()[i], 0.5f);
  return opacity;
}

/// The best that is known of the depth.
void write_depth_picture(const fs::path& results, const View& view, const DepthLayers& layers) {
  const Image depth = best_estimates(layers).depth;
  const Image shown = opacity_of(layers, depth);
  write_png(view_path(results, "depth", view.name, ".png").string(),
            depth_picture(depth, shown, shown_depths(depth, shown)), kAsItIs);
}

/// Unit vectors as colours: -1 to 1 as black to full.
Image normal_picture(const Image& normal) {
  Image picture(normal.width(), normal.height(), 3);
  for (std::size_t i = 0; i < normal.data().size(); i += 3) {
    const float* n = &normal.data()[i];
    if (n[0] == 0 && n[1] == 0 && n[2] == 0) continue;
    for (int c = 0; c < 3; ++c) picture.data()[i + c] = 0.5f + 0.5f * n[c];
  }
  return picture;
}

double mean(double sum, std::int64_t count) { return count > 0 ? sum / static_cast<double>(count) : 0; }

}  // namespace

DepthStageFigures refine_depth_files(const Dataset& dataset, const PhotographLoader& load,
                                     const DepthScene& scene, const DepthWork& work,
                                     const DepthStageOptions& options, RunContext& context,
                                     double progress_begin, double progress_end) {
  const fs::path& results = work.folders.results;
  PutAside aside(results, dataset);
  DepthFiles files;
  files.read = [&](int v) {
    if (aside.has_layers(v)) return aside.recall_layers(v);
    DepthLayers layers = read_layers(work.folders, dataset.views[v]);
    if (!options.bp) layers.depth_bp = layers.variance_bp = {};  // of an earlier time
    layers.depth_refined = layers.variance_refined = layers.normal = {};
    if (options.refine && !options.bp) aside.keep(v, layers);  // it is read again
    return layers;
  };
  files.write = [&](int v, const DepthLayers& layers) {
    if (options.refine && layers.depth_refined.empty()) return aside.keep(v, layers);
    write_depth(depth_path(results, dataset.views[v].name), layers);
    write_depth_picture(results, dataset.views[v], layers);
  };
  files.keep = [&](int v, const RefinedView& view) { aside.keep(v, view); };
  files.recall = [&](int v) { return aside.recall(v); };
  DepthStageOptions first = options, second = options;
  first.refine = false;
  second.bp = false;
  const double middle = options.bp ? progress_begin + 0.15 * (progress_end - progress_begin) : progress_begin;
  DepthStageFigures figures;
  if (options.bp) {
    const PeakMemory memory;
    figures = run_depth_stage(dataset, load, scene, files, first, context, progress_begin, middle);
    figures.propagate_peak_bytes = memory.bytes();
  }
  if (!options.bp && !options.refine)
    parallel_for(dataset.views.size(), context.thread_count(), [&](std::int64_t v, int) {
      context.throw_if_cancelled();
      files.write(static_cast<int>(v), files.read(static_cast<int>(v)));  // without what was added before
    });
  if (options.refine) {
    const PeakMemory memory;
    files.most_held_bytes =
        std::min<std::size_t>(files.most_held_bytes, bytes_left(work.memory) / kHeldShare);
    figures.add(run_depth_stage(dataset, load, scene, files, second, context, middle, progress_end));
    figures.refine_peak_bytes = memory.bytes();
  }
  return figures;
}

ordered_json to_json(const DepthStageFigures& figures) {
  ordered_json json;
  const PropagationFigures& bp = figures.propagation;
  if (bp.views > 0)
    json["bp"] = {
        {"pixels", bp.pixels},
        {"filled_pixels", bp.filled},
        {"mean_variance_before", mean(bp.variance_before, bp.pixels)},
        {"mean_variance_after", mean(bp.variance_after, bp.pixels)},
        {"mean_prior_sigma", bp.prior_sigma / bp.views},
        {"sweeps", bp.sweeps},
        {"views", bp.views},
        {"converged_views", bp.converged},
        {"largest_movement_sigmas", bp.movement},
        {"propagation_seconds_per_megapixel", figures.pixels > 0 ? 1e6 * bp.seconds / figures.pixels : 0}};
  if (figures.refine_seconds > 0)
    json["refined"] = {
        {"pixels", figures.refined_pixels},
        {"matched_pixels", figures.matched_pixels},
        {"agreed_pixels", figures.agreed_pixels},
        {"scale", figures.refine_scale},
        {"seconds_per_megapixel", figures.pixels > 0 ? 1e6 * figures.refine_seconds / figures.pixels : 0}};
  return json;
}

void add_refined_pictures(const DepthLayers& layers, double voxel_size, ReportView& view) {
  const auto add = [&](const std::string& method, const Image& depth, const Image& variance) {
    if (depth.empty()) return;
    view.pictures.push_back(report_picture(
        "depth, " + method, depth_picture(depth, layers.opacity, shown_depths(depth, layers.opacity))));
    view.pictures.push_back(report_picture("sigma of depth, " + method,
                                           sigma_picture(variance, depth, layers.opacity, voxel_size)));
  };
  add("after belief propagation", layers.depth_bp, layers.variance_bp);
  add("refined", layers.depth_refined, layers.variance_refined);
  if (!layers.normal.empty())
    view.pictures.push_back(report_picture("normals", normal_picture(layers.normal)));
}

std::vector<StageRecord> stage_records(const DepthStageFigures& figures) {
  std::vector<StageRecord> records;
  if (figures.propagate_seconds > 0)
    records.push_back({kPropagationStage, figures.propagate_seconds, figures.propagate_peak_bytes});
  if (figures.refine_seconds > 0)
    records.push_back({kRefinementStage, figures.refine_seconds, figures.refine_peak_bytes});
  return records;
}

std::string brief(const DepthStageFigures& figures) {
  std::string text;
  const PropagationFigures& bp = figures.propagation;
  if (bp.views > 0)
    text += formatted(
        "belief propagation: mean variance of depth %.4g before, %.4g after; %d of %d views converged "
        "(the last sweep moved a depth by at most %.2g of its deviation); %.1f s\n",
        mean(bp.variance_before, bp.pixels), mean(bp.variance_after, bp.pixels), bp.converged, bp.views,
        bp.movement, figures.propagate_seconds);
  if (figures.refine_seconds > 0)
    text += formatted("refinement: of %lld pixels with depth, %.1f %% matched, %.1f %% agreed on; %.1f s\n",
                      static_cast<long long>(figures.refined_pixels),
                      100 * mean(static_cast<double>(figures.matched_pixels), figures.refined_pixels),
                      100 * mean(static_cast<double>(figures.agreed_pixels), figures.refined_pixels),
                      figures.refine_seconds);
  return text;
}

}  // namespace roxel::cli

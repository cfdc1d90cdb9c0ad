#include "describe.h"

#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "progress_display.h"
#include "roxel/base/formatted.h"
#include "roxel/dataset/box_visibility.h"
#include "roxel/depth/scaled_view.h"
#include "roxel/solve/estimate.h"
#include "roxel/solve/idle_options.h"

namespace roxel::cli {
namespace {

using nlohmann::ordered_json;

constexpr int kSurveyedViews = 16;
constexpr double kGibibyte = 1024.0 * 1024.0 * 1024.0;

/// With the light that may be found once the run begins, where its options leave that to the photographs.
Scene with_light(const ReconstructOptions& options, Scene scene) {
  if (options.background == BackgroundChoice::kSky) scene.background.kind = BackgroundKind::kMask;
  if (options.illumination == IlluminationChoice::kNone || options.illumination == IlluminationChoice::kGain)
    return scene;
  scene.light.from = LightSource::kSky;
  scene.light.local_matching = options.matching != Matching::kCanonical;
  return scene;
}

/// The scene as the reconstruction will see it; background, exposure and surround from a few images only, so
/// that large data sets are described quickly.
Scene preview_scene(const Input& input, const ReconstructOptions& options, RunContext& context) {
  Scene scene = lay_out(input.dataset, input.load, options);
  Dataset few = input.dataset;
  const int count = static_cast<int>(few.views.size());
  const int kept = std::min(count, kSurveyedViews);
  std::vector<View> views;
  for (int i = 0; i < kept; ++i) views.push_back(few.views[static_cast<std::size_t>(i) * count / kept]);
  for (View& view : views) view.node_id = view.node_idx;
  few.views = std::move(views);
  few.nodes.clear();
  assign_nodes(few);
  ReconstructOptions with_box = options;
  const Eigen::Vector3d low = scene.bounds.box.min(), high = scene.bounds.box.max();
  with_box.bounds = {low.x(), low.y(), low.z(), high.x(), high.y(), high.z()};
  if (options.illumination == IlluminationChoice::kSky ||
      options.illumination == IlluminationChoice::kSkyNormal)
    with_box.illumination = IlluminationChoice::kNone;  // skies are fitted when the run begins
  if (options.background == BackgroundChoice::kSky) with_box.background = BackgroundChoice::kAuto;
  with_box.memory = std::numeric_limits<double>::max() / kGibibyte;  // of all images it is asked below
  const Scene surveyed = survey(few, input.load, with_box, context);
  scene.background = surveyed.background;
  scene.exposure = surveyed.exposure;
  scene.surround_count = surveyed.surround_count;
  for (const std::string& note : surveyed.notes)
    if (!note.starts_with("bounds:")) scene.notes.push_back(note);
  for (std::string& idle : idle_options(options, with_light(options, surveyed)))
    scene.warnings.push_back(std::move(idle));
  return scene;
}

std::string image_sizes(const Dataset& dataset) {
  std::map<std::pair<int, int>, int> sizes;
  for (const View& view : dataset.views)
    ++sizes[{view.camera.intrinsics.width, view.camera.intrinsics.height}];
  std::string text;
  for (const auto& [size, count] : sizes) {
    if (text.size() > 200) return text + ", ...";
    text += (text.empty() ? "" : ", ") + formatted("%d x %d", size.first, size.second);
    if (sizes.size() > 1) text += formatted(" (%d)", count);
  }
  return text;
}

int count_masks(const Dataset& dataset) {
  int masks = 0;
  for (const View& view : dataset.views) masks += !view.mask_path.empty() || view.has_alpha;
  return masks;
}

int count_lenses(const Dataset& dataset) {
  std::vector<Lens> lenses;
  for (const View& view : dataset.views)
    if (std::find(lenses.begin(), lenses.end(), view.lens) == lenses.end()) lenses.push_back(view.lens);
  return static_cast<int>(lenses.size());
}

std::string box_text(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d a = box.min(), b = box.max();
  return formatted("%.6g,%.6g,%.6g,%.6g,%.6g,%.6g", a.x(), a.y(), a.z(), b.x(), b.y(), b.z());
}

std::string memory_text(double bytes) {
  return bytes < 0.1 * kGibibyte ? formatted("%.0f MiB", bytes / 1024 / 1024)
                                 : formatted("%.1f GiB", bytes / kGibibyte);
}

std::string memory_row(const MemoryPlan& plan) {
  std::string text = "about " + memory_text(plan.peak_bytes);
  if (std::isfinite(plan.sample_bytes))
    text += ", where all but " + memory_text(plan.sample_bytes) + " of samples are made anew in each pass";
  if (plan.workers < std::numeric_limits<int>::max())
    text += formatted(", and passes run on %d %s", plan.workers, plan.workers == 1 ? "thread" : "threads");
  return text;
}

/// "  label      value" with the values in one column.
std::string row(const std::string& label, const std::string& value) {
  std::string text = "  " + label;
  text.resize(14, ' ');
  return text + value + "\n";
}

/// Of a pixel that shows the object, on one core, measured on synthetic heads: belief propagation, fusion and
/// texture; and refinement, of a pixel as it sees them. Others cost next to nothing.
constexpr double kSurfaceSecondsPerPixel = 7e-6, kRefineSecondsPerPixel = 15e-6;

/// `voxel_px`: pixels that a voxel is across.
double surface_seconds(const Dataset& dataset, double voxel_px, const DepthStageOptions& depth, int threads) {
  const std::vector<double> pixels = pixels_of_views(dataset);
  const int scale = depth.refine_scale.value_or(choose_scale({voxel_px}, pixels));
  const double each = kSurfaceSecondsPerPixel + (depth.refine ? kRefineSecondsPerPixel / (scale * scale) : 0);
  return each * std::reduce(pixels.begin(), pixels.end()) / threads;
}

/// All that is said, before it is put into words.
struct Facts {
  const Dataset& dataset;
  const ReconstructOptions& options;
  const DepthStageOptions& depth;
  int threads;
  Scene scene;
  Eigen::Vector3i voxels;
  BoxVisibility seen;
  CostEstimate cost;
  double depth_seconds;
  std::vector<std::string> notes, warnings;
};

Facts find_facts(const Input& input, const ReconstructOptions& options, const DepthStageOptions& depth,
                 RunContext& context) {
  const Dataset& dataset = input.dataset;
  const int threads = context.thread_count();
  Scene scene = preview_scene(input, options, context);
  const Eigen::Vector3i voxels = nested_frames(scene.bounds.box, scene.voxel_size, 0)[0].size_in_voxels();
  const BoxVisibility seen = box_visibility(dataset, scene.bounds, scene.voxel_size);
  CostEstimate cost = estimate_cost(dataset, scene, options, threads);
  const double depth_seconds = surface_seconds(dataset, seen.median_pixels_per_voxel, depth, threads);
  std::vector<std::string> notes = dataset.notes, warnings = dataset.warnings;
  notes.insert(notes.end(), scene.notes.begin(), scene.notes.end());
  warnings.insert(warnings.end(), scene.warnings.begin(), scene.warnings.end());
  if (!cost.memory.fits) warnings.push_back("memory: " + memory_shortage(dataset, scene, options, threads));
  return {dataset, options,         depth,         threads,          std::move(scene),   voxels,
          seen,    std::move(cost), depth_seconds, std::move(notes), std::move(warnings)};
}

std::string photographs_text(const Dataset& dataset) {
  const int masks = count_masks(dataset);
  std::string text = dataset.path + "\n";
  text += row("format", dataset.format);
  text += row("images", formatted("%zu, %s pixels", dataset.views.size(), image_sizes(dataset).c_str()));
  text += row("masks", masks == 0 ? "none" : formatted("%d", masks));
  text += row("cameras", formatted("%d", count_lenses(dataset)));
  text += row("nodes", formatted("%zu", dataset.nodes.size()));
  if (!dataset.points.empty()) text += row("points", formatted("%zu", dataset.points.size()));
  return text;
}

std::string box_rows(const Facts& facts) {
  const Scene& scene = facts.scene;
  const Eigen::Vector3i& voxels = facts.voxels;
  const BoxVisibility& seen = facts.seen;
  std::string text = row("bounds", box_text(scene.bounds.box));
  text += row("", scene.bounds.how);
  text += row("far", formatted("%.6g", scene.bounds.far));
  text += row("voxels", formatted("%d x %d x %d of %.6g, %d levels", voxels.x(), voxels.y(), voxels.z(),
                                  scene.voxel_size, facts.options.levels));
  text += row("surround", scene.surround_count > 0 ? formatted("%d lattices", scene.surround_count) : "none");
  text += row("voxel in px", formatted("%.2f (median of %d images that see the box; %.2f to %.2f)",
                                       seen.median_pixels_per_voxel, seen.views, seen.min_pixels_per_voxel,
                                       seen.max_pixels_per_voxel));
  text += row("seen twice", formatted("%.0f %% of the box", 100 * seen.share_seen_twice));
  return text;
}

std::string cost_rows(const Facts& facts) {
  std::string text = row("memory", memory_row(facts.cost.memory));
  text +=
      row("time", "about " + duration_text(facts.cost.seconds) + formatted(" on %d threads", facts.threads));
  text += row("", "and up to " + duration_text(facts.depth_seconds) + " for " +
                      (facts.depth.refine ? "refined " : "") + "depth and the surface");
  return text;
}

std::string remarks(const Facts& facts) {
  std::string text;
  for (const std::string& note : facts.notes)
    if (!note.starts_with("bounds:")) text += row("note", note);
  for (const std::string& warning : facts.warnings) text += row("WARNING", warning);
  return text;
}

ordered_json estimate_json(const Facts& facts) {
  ordered_json levels = ordered_json::array();
  for (const LevelEstimate& level : facts.cost.levels)
    levels.push_back({{"voxel_size", level.voxel_size},
                      {"voxels", level.voxels},
                      {"steps_per_pass", level.steps_per_pass}});
  const MemoryPlan& memory = facts.cost.memory;
  return {{"memory_bytes", memory.peak_bytes},
          {"memory_limit_bytes", memory.limit_bytes},
          {"memory_fits", memory.fits},
          {"seconds", facts.cost.seconds},
          {"depth_seconds", facts.depth_seconds},
          {"threads", facts.threads},
          {"levels", levels}};
}

ordered_json facts_json(const Facts& facts) {
  const Dataset& dataset = facts.dataset;
  const Scene& scene = facts.scene;
  const BoxVisibility& seen = facts.seen;
  const Eigen::Vector3d low = scene.bounds.box.min(), high = scene.bounds.box.max();
  return {{"dataset", dataset.path},
          {"format", dataset.format},
          {"images", dataset.views.size()},
          {"image_sizes", image_sizes(dataset)},
          {"masks", count_masks(dataset)},
          {"cameras", count_lenses(dataset)},
          {"nodes", dataset.nodes.size()},
          {"points", dataset.points.size()},
          {"bounds", {low.x(), low.y(), low.z(), high.x(), high.y(), high.z()}},
          {"bounds_from", scene.bounds.how},
          {"far", scene.bounds.far},
          {"voxel_size", scene.voxel_size},
          {"voxels", {facts.voxels.x(), facts.voxels.y(), facts.voxels.z()}},
          {"levels", facts.options.levels},
          {"surround_lattices", scene.surround_count},
          {"pixels_per_voxel",
           {{"min", seen.min_pixels_per_voxel},
            {"median", seen.median_pixels_per_voxel},
            {"max", seen.max_pixels_per_voxel}}},
          {"views_of_box", seen.views},
          {"share_seen_twice", seen.share_seen_twice},
          {"estimate", estimate_json(facts)},
          {"notes", facts.notes},
          {"warnings", facts.warnings}};
}

}  // namespace

Description describe(const Input& input, const ReconstructOptions& options, const DepthStageOptions& depth,
                     RunContext& context) {
  const Facts facts = find_facts(input, options, depth, context);
  return {photographs_text(input.dataset) + box_rows(facts) + cost_rows(facts) + remarks(facts),
          facts_json(facts)};
}

}  // namespace roxel::cli

#include "roxel/solve/scene.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/dataset/box_visibility.h"
#include "roxel/image/outline.h"
#include "roxel/solve/background_choice.h"
#include "roxel/solve/estimate.h"
#include "roxel/solve/idle_options.h"

namespace roxel {

namespace {

constexpr int kMostSurround = 12;
constexpr double kMiddleGrey = 0.18;
constexpr float kLargestComponent = 1000;  ///< see infer/evidence.h: colour sums are bounded

MatchModel make_model(const ReconstructOptions& options) {
  MatchModel model;
  const double noise = options.noise.value_or(default_noise(options.color_space));
  for (float& variance : model.noise_variance) variance = static_cast<float>(noise * noise);
  model.agreement = options.agreement;
  const double default_scale = (options.agreement == Agreement::kLinear ? 5 : 2.5) * noise;
  model.scale = static_cast<float>(options.agreement_scale.value_or(default_scale));
  model.outlier = static_cast<float>(options.outlier);
  model.uninformative = static_cast<float>(
      options.uninformative.value_or(unknown_color_likelihood(options.color_space, noise)));
  model.evidence_half = options.predictive ? static_cast<float>(options.evidence_half) : 0.0f;
  return model;
}

BoundsOptions bounds_options(const ReconstructOptions& options, const PhotographLoader& load) {
  BoundsOptions bounds;
  bounds.load_masks = load;
  bounds.near = options.near;
  bounds.far = options.far;
  if (options.bounds) {
    const auto& b = *options.bounds;
    bounds.box = Eigen::AlignedBox3d(Eigen::Vector3d(b[0], b[1], b[2]), Eigen::Vector3d(b[3], b[4], b[5]));
  }
  return bounds;
}

/// Lattices around the box until the outermost reaches as far as any ray, each twice as large as the one
/// within.
int count_surround(const Dataset& dataset, const SceneBounds& bounds) {
  double reach = 0;
  for (std::size_t v = 0; v < dataset.views.size(); ++v)
    reach = std::max(
        reach, (dataset.views[v].camera.pose.centre - bounds.box.center()).norm() + bounds.views[v].far);
  const double half = 0.5 * bounds.box.sizes().maxCoeff();
  return std::clamp(static_cast<int>(std::ceil(std::log2(reach / half))), 1, kMostSurround);
}

/// Luminances of a thin sample of the usable object pixels.
std::vector<float> sample_luminance(const Photograph& photo) {
  std::vector<float> luminances;
  const std::size_t pixels = static_cast<std::size_t>(photo.rgb.width()) * photo.rgb.height();
  const std::size_t stride = std::max<std::size_t>(1, pixels / 4096);
  for (std::size_t i = stride / 2; i < pixels; i += stride) {
    if (!photo.valid.empty() && photo.valid.data()[i] == 0) continue;
    if (!photo.foreground.empty() && photo.foreground.data()[i] < 128) continue;
    const float* p = photo.rgb.data().data() + 3 * i;
    luminances.push_back(0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2]);
  }
  return luminances;
}

/// 1 where nothing is brighter than display white; otherwise the scale that brings the median to middle grey.
double choose_exposure(std::vector<float> luminances, std::vector<std::string>& notes) {
  if (luminances.empty()) return 1;
  const float brightest = *std::max_element(luminances.begin(), luminances.end());
  if (brightest <= 1.001f) return 1;
  const auto middle = luminances.begin() + luminances.size() / 2;
  std::nth_element(luminances.begin(), middle, luminances.end());
  const double exposure = std::max(1e-12, *middle / kMiddleGrey);
  notes.push_back("exposure: radiance " + std::to_string(exposure) +
                  " counts as white (high dynamic range images)");
  return exposure;
}

Image sample_image(const Dataset& dataset, int view_idx, const Photograph& photo, const Scene& scene,
                   SampleColors colors) {
  const double focal_px = dataset.views[view_idx].camera.intrinsics.fx;
  if (colors == SampleColors::kRadiance) {
    const bool is_gain = scene.light.from == LightSource::kSky && scene.light.is_gain(view_idx);
    Image samples = canonical_image(photo, view_idx, scene.exposure, is_gain ? scene.light : Light{});
    for (float& value : samples.data()) value = std::clamp(value, 0.0f, kLargestComponent);
    return samples;
  }
  Image samples = colors == SampleColors::kCanonical
                      ? canonical_image(photo, view_idx, scene.exposure, scene.light)
                      : matching_image(photo, view_idx, focal_px, scene.exposure, scene.light);
  scene.transform.from_rgb_in_place(samples.data().data(), samples.data().size() / 3);
  for (float& value : samples.data()) value = std::clamp(value, -kLargestComponent, kLargestComponent);
  return samples;
}

/// Whose light is that of their dome; the others get gains.
void say_whose_light(const Daylight& daylight, const std::string& reasons, Scene& scene) {
  for (std::size_t v = 0; v < daylight.sky_of_views.size(); ++v)
    scene.light.of_dome.push_back(daylight.of_view(static_cast<int>(v)) != nullptr);
  scene.light.shared = daylight.sky_of_views;
  if (!scene.light.has_gains()) return scene.notes.push_back("light: that of each view's sky is divided out");
  const auto known = std::count(scene.light.of_dome.begin(), scene.light.of_dome.end(), 1);
  scene.warnings.push_back("light: that of the sky is divided out of " + std::to_string(known) + " of " +
                           std::to_string(scene.light.of_dome.size()) +
                           " views; the others have gains that follow the volume: " + reasons);
}

/// Skies that are known count unless options say otherwise; then the light changes, and colours are compared
/// without it.
void choose_light(const Daylight* daylight, const ReconstructOptions& options, Scene& scene) {
  Light& light = scene.light;
  const IlluminationChoice choice = options.illumination;
  light.by_normal = choice == IlluminationChoice::kSkyNormal;
  const bool wanted = choice == IlluminationChoice::kSky || light.by_normal;
  const std::string reasons = daylight ? reasons_without_light(*daylight) : "";
  if (wanted || (choice == IlluminationChoice::kAuto && daylight)) {
    if (daylight) light.of_views = light_of_views(*daylight, options.sky_light);
    if (light.of_views.empty() && wanted)
      throw_invalid(light.by_normal ? "--illumination sky-normal" : "--illumination sky",
                    "no photograph whose light is known" + (reasons.empty() ? "" : ": " + reasons),
                    "photographs that show the sky, with time and place or --sun, or --illumination gain");
    if (light.of_views.empty() && !reasons.empty())
      scene.warnings.push_back("light: that of no photograph's sky is known: " + reasons);
  }
  light.from = !light.of_views.empty()               ? LightSource::kSky
               : choice == IlluminationChoice::kGain ? LightSource::kGain
                                                     : LightSource::kNone;
  light.local_matching = options.matching == Matching::kLocal ||
                         (options.matching == Matching::kAuto && light.from == LightSource::kSky);
  if (light.from == LightSource::kSky) say_whose_light(*daylight, reasons, scene);
  if (light.by_normal) scene.notes.push_back("light: voxels are painted without shading and cast shadows");
  if (light.local_matching) scene.notes.push_back("matching: without the light of the neighbourhood");
}

/// Every level's lattice is that of the coarsest, divided: with many levels its bricks reach far out of the
/// box.
void check_levels(const Scene& scene, const ReconstructOptions& options) {
  const double coarsest = std::ldexp(scene.voxel_size, options.levels - 1);
  const Eigen::Vector3d bricks =
      nested_frames(scene.bounds.box, coarsest, 0)[0].size_in_bricks.cast<double>() *
      std::ldexp(1.0, options.levels - 1);
  if (bricks.prod() > kMaxBricks)
    throw_invalid(
        "--levels",
        std::to_string(options.levels) + " levels down to voxels of " + std::to_string(scene.voxel_size),
        "at most 2^28 bricks of 8^3 voxels at the finest level: fewer levels, or larger voxels");
}

/// Width of a voxel in pixels at the depth of the box's centre (or half way to far, from inside the box).
double footprint_px(const PinholeCamera& camera, const Scene& scene, double voxel_size,
                    const Stretch& range) {
  const double centre_depth = camera.camera_from_world(scene.bounds.box.center()).z();
  const bool outside = !scene.bounds.box.contains(camera.pose.centre) && centre_depth > 0;
  const double depth = outside ? centre_depth : 0.5 * range.end;
  return 0.5 * (camera.intrinsics.fx + camera.intrinsics.fy) * voxel_size / depth;
}

}  // namespace

bool Scene::has_open_ends() const {
  return background.kind == BackgroundKind::kUnknown || background.kind == BackgroundKind::kNone ||
         (background.kind == BackgroundKind::kMask &&
          std::find(masked.begin(), masked.end(), 0) != masked.end());
}

Scene lay_out(const Dataset& dataset, const PhotographLoader& load, const ReconstructOptions& options) {
  reconstruct_option_table().validate(options);
  Scene scene;
  scene.bounds = default_bounds(dataset, bounds_options(options, load));
  scene.seen_from_inside = std::any_of(dataset.views.begin(), dataset.views.end(), [&](const View& view) {
    return scene.bounds.box.contains(view.camera.pose.centre);
  });
  const double longest = scene.bounds.box.sizes().maxCoeff();
  scene.voxel_size = options.voxel_size.value_or(longest / options.resolution);
  if (longest / scene.voxel_size > 65536)
    throw_invalid("--voxel-size",
                  std::to_string(longest / scene.voxel_size) + " voxels along the longest side",
                  "at most 65536");
  check_levels(scene, options);
  scene.warnings = scale_warnings(dataset, scene.bounds, scene.voxel_size);
  scene.notes.push_back("bounds: " + scene.bounds.how);
  scene.transform =
      ColorTransform(options.color_space, parse_white_point(options.white_point, "--white-point"));
  scene.light.blur_deg = options.matching_blur;
  scene.model = make_model(options);
  scene.background.unknown_likelihood = static_cast<float>(
      unknown_color_likelihood(options.color_space, std::sqrt(scene.model.noise_variance[0])));
  return scene;
}

namespace {

void share_out_memory(const Dataset& dataset, const ReconstructOptions& options, int threads, Scene& scene) {
  require_memory(dataset, scene, options, threads);
  scene.memory = plan_memory(dataset, scene, options, threads);
  if (!scene.memory.fits)
    scene.warnings.push_back("memory: " + memory_shortage(dataset, scene, options, threads));
}

}  // namespace

Scene survey(const Dataset& dataset, const PhotographLoader& load, const ReconstructOptions& options,
             const RunContext& context, const Daylight* daylight) {
  Scene scene = lay_out(dataset, load, options);
  std::vector<std::vector<float>> luminances(dataset.views.size());
  std::vector<BorderSample> borders(dataset.views.size());
  parallel_for(dataset.views.size(), context.thread_count(), [&](std::int64_t v, int) {
    context.throw_if_cancelled();
    const Photograph photo = load(dataset.views[v]);
    luminances[v] = sample_luminance(photo);
    borders[v] = sample_border(photo);
  });
  std::vector<float> all;
  for (const auto& part : luminances) all.insert(all.end(), part.begin(), part.end());
  scene.exposure = choose_exposure(std::move(all), scene.notes);
  choose_light(daylight, options, scene);
  choose_background(borders, options, daylight, scene);
  // A mask of the sky says nothing of rays that leave the box and do not end in the sky; a box with cameras
  // in it is the whole of what they see.
  const bool ends_unknown =
      scene.has_open_ends() || (daylight && daylight->has_masks() && !scene.seen_from_inside);
  const bool surround =
      options.surround == SurroundChoice::kOn || (options.surround == SurroundChoice::kAuto && ends_unknown);
  scene.surround_count = surround ? count_surround(dataset, scene.bounds) : 0;
  if (surround)
    scene.notes.push_back("surround: " + std::to_string(scene.surround_count) + " lattices around the box");
  share_out_memory(dataset, options, context.thread_count(), scene);
  for (std::string& idle : idle_options(options, scene)) scene.warnings.push_back(std::move(idle));
  return scene;
}

int most_passes(const Scene& scene, const ReconstructOptions& options, int level) {
  if (level == options.levels) return options.passes;
  if (options.coarse_passes > 0) return options.coarse_passes;
  const bool of_objects = scene.background.kind == BackgroundKind::kMask && !scene.has_open_ends() &&
                          scene.surround_count == 0 && !scene.seen_from_inside;
  return of_objects ? 2 * options.passes : options.passes;
}

int most_drafts(const Scene& scene, const ReconstructOptions& options, int level) {
  return std::min(options.draft_passes, most_passes(scene, options, level) - 1);
}

std::vector<LatticeFrame> frames_of_first_level(const Scene& scene, const ReconstructOptions& options) {
  return nested_frames(scene.bounds.box, std::ldexp(scene.voxel_size, options.levels - 1),
                       scene.surround_count);
}

Stretch view_range(const Scene& scene, const Dataset& dataset, int view_idx) {
  Stretch range{scene.bounds.views[view_idx].near, scene.bounds.views[view_idx].far};
  if (scene.surround_count > 0) return range;
  double farthest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto type = static_cast<Eigen::AlignedBox3d::CornerType>(corner);
    farthest = std::max(farthest,
                        dataset.views[view_idx].camera.camera_from_world(scene.bounds.box.corner(type)).z());
  }
  range.end = std::max(range.begin, std::min(range.end, 1.01 * farthest + scene.voxel_size));
  return range;
}

namespace {

/// The first views, as many as there is room for.
std::vector<bool> which_stay(const std::vector<SampleView>& views, const MemoryPlan& memory) {
  std::vector<bool> stay(views.size());
  double bytes = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Intrinsics& k = views[v].camera.intrinsics;
    bytes += pyramid_bytes(static_cast<double>(k.width) * k.height, views[v].plan.finest_level);
    stay[v] = bytes <= memory.sample_bytes;
  }
  return stay;
}

}  // namespace

std::vector<SampleNode> make_samples(const Dataset& dataset, const PhotographLoader& load, const Scene& scene,
                                     double voxel_size, const ReconstructOptions& options,
                                     const RunContext& context, SampleColors colors) {
  std::vector<SampleView> views(dataset.views.size());
  SamplePlanOptions plan_options;
  plan_options.samples_per_voxel = options.samples_per_voxel;
  plan_options.adaptive = options.adaptive;
  for (std::size_t v = 0; v < views.size(); ++v) {
    SampleView& view = views[v];
    view.camera = dataset.views[v].camera;
    view.plan = make_sample_plan(view.camera, scene.bounds.box, voxel_size,
                                 view_range(scene, dataset, static_cast<int>(v)), plan_options);
    view.draft_plan = view.plan.coarser();
    const double footprint = std::max(1.0, footprint_px(view.camera, scene, voxel_size, view.plan.range));
    view.pixel_weight = static_cast<float>(options.observation_weight / (footprint * footprint));
  }
  const double outline_weight = scene.background.kind == BackgroundKind::kMask ? options.outline_weight : 1.0;
  const std::vector<bool> stay = which_stay(views, scene.memory);
  parallel_for(dataset.views.size(), context.thread_count(), [&](std::int64_t v, int) {
    context.throw_if_cancelled();
    SampleView& view = views[v];
    view.make_pyramid = [&dataset, &load, &scene, v, colors, outline_weight, finest = view.plan.finest_level,
                         root = view.draft_plan.root_level] {
      const Photograph photo = load(dataset.views[v]);
      return std::make_shared<const SamplePyramid>(
          sample_image(dataset, static_cast<int>(v), photo, scene, colors),
          lighter_on_outline(photo.valid, photo.foreground, outline_weight), photo.foreground, finest, root);
    };
    if (stay[v]) view.pyramid = view.make_pyramid();
  });
  std::vector<SampleNode> nodes(dataset.nodes.size());
  for (std::size_t v = 0; v < views.size(); ++v)
    nodes[dataset.views[v].node_idx].push_back(std::move(views[v]));
  return nodes;
}

std::vector<SampleNode> drafts_of(std::vector<SampleNode> nodes) {
  for (SampleNode& node : nodes)
    for (SampleView& view : node) view.plan = view.draft_plan;
  return nodes;
}

SampleView make_full_view(const Dataset& dataset, int view_idx, const Photograph& photo, const Scene& scene) {
  SampleView view;
  view.camera = dataset.views[view_idx].camera;
  view.plan.range = view_range(scene, dataset, view_idx);
  view.pyramid =
      std::make_shared<SamplePyramid>(sample_image(dataset, view_idx, photo, scene, SampleColors::kMatching),
                                      photo.valid, photo.foreground, 0, 0);
  return view;
}

}  // namespace roxel

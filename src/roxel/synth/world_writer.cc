#include "roxel/synth/world_writer.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <set>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/synth/dataset_text.h"
#include "roxel/synth/illumination_text.h"
#include "roxel/synth/lights.h"
#include "roxel/synth/path_renderer.h"
#include "roxel/synth/sensor_noise.h"
#include "roxel/synth/transients.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Eigen::Vector3f;

void require(const char* field, double value, double low, double high) {
  if (value >= low && value <= high) return;
  std::ostringstream found, range;
  found << value;
  range << low << " to " << high;
  throw_invalid(field, found.str(), range.str());
}

WorldRequest checked_request(const WorldDefaults& defaults, const SynthOptions& options) {
  const WorldRequest request{options.images.value_or(defaults.images), options.width.value_or(defaults.width),
                             options.height.value_or(defaults.height), options.seed};
  require("images", request.images, 2, defaults.most_images);
  require("width", request.width, 16, 16384);
  require("height", request.height, 16, 16384);
  require("transients", options.transients, 0, 1000);
  require("noise", options.noise, 0, 1);
  require("pose noise (rotation)", options.pose_noise.rotation_deg, 0, 90);
  require("pose noise (translation)", options.pose_noise.translation, 0, 1e6);
  require("samples", options.samples.value_or(defaults.samples), 1, 4096);
  require("points", options.points, 0, 1000000);
  return request;
}

/// The world, its lights, and what stands in it at each occasion.
struct Stage {
  World world;
  Lights lights;
  std::unique_ptr<RayScene> lasting;
  std::vector<TriangleMesh> passing;  ///< at each occasion; empty without transients
  PathOptions path;

  const WorldLight& light(int occasion) const { return lights.all[lights.of_occasion[occasion]]; }
};

Stage set_stage(WorldKind kind, const WorldRequest& request, const SynthOptions& options, LightKind light,
                const RunContext& context) {
  Stage stage;
  stage.world = make_world(kind, request);
  if (options.environment_seen) stage.world.environment_seen = *options.environment_seen;
  stage.lights = make_lights(stage.world, {light, options.moving_shadows, options.seed}, context);
  stage.lasting = std::make_unique<RayScene>(stage.world.mesh);
  const int occasions = static_cast<int>(stage.world.times_utc_s.size());
  for (int i = 0; options.transients > 0 && i < occasions; ++i)
    stage.passing.push_back(make_transients(stage.world, i, options.transients, options.seed));
  stage.path.samples = options.samples.value_or(world_defaults(kind).samples);
  // With so many paths there is little grain left to smooth.
  constexpr int kPlenty = 64;
  if (stage.path.samples >= kPlenty) stage.path.smoothing = 0;
  stage.path.environment_seen = stage.world.environment_seen;
  stage.path.skylight = stage.world.skylight;
  stage.path.seed = options.seed;
  return stage;
}

void make_folders(const fs::path& folder, const Stage& stage) {
  std::vector<const char*> names = {"images", "depth", "albedo", "normal", "sky"};
  if (stage.world.masked) names.push_back("mask");
  if (!stage.passing.empty()) names.push_back("transient");
  for (const char* name : names) {
    std::error_code error;
    fs::create_directories(folder / name, error);
    if (error) throw IoError((folder / name).string() + ": cannot be made: " + error.message());
  }
}

void write_pixels(const fs::path& folder, const std::string& name, const Picture& picture, const Stage& stage,
                  const WorldWriters& writers) {
  const bool half = stage.world.high_dynamic_range;
  (half ? writers.half_exr : writers.png)(folder / "images" / (name + (half ? ".exr" : ".png")), picture.rgb);
  if (stage.world.masked) writers.mask(folder / "mask" / (name + ".png"), picture.mask);
  if (!stage.passing.empty()) writers.mask(folder / "transient" / (name + ".png"), picture.transient);
  writers.depth(folder / "depth" / (name + ".exr"), picture.depth);
  writers.half_exr(folder / "albedo" / (name + ".exr"), picture.albedo);
  writers.half_exr(folder / "normal" / (name + ".exr"), picture.normal);
}

void write_lights(const fs::path& folder, const Lights& lights, const WorldWriters& writers) {
  for (const WorldLight& light : lights.all) {
    writers.half_exr(folder / "sky" / (light.name + ".exr"), light.environment.map_with_disc());
    writers.half_exr(folder / "sky" / (light.name + "_nosun.exr"), light.environment.map_without_disc());
  }
}

/// As the sensor has it: exposed, and with its noise.
Picture photograph(const Stage& stage, int shot_idx, const SynthOptions& options, const RunContext& context) {
  const Shot& shot = stage.world.shots[shot_idx];
  const WorldLight& light = stage.light(shot.occasion);
  // Trees of rays with passing things are made when they are wanted: a hundred occasions would fill memory.
  const auto everything = stage.passing.empty()
                              ? nullptr
                              : std::make_unique<RayScene>(stage.world.mesh, stage.passing[shot.occasion]);
  const PathRenderer renderer(everything ? *everything : *stage.lasting, *stage.lasting,
                              stage.world.materials, light.environment, stage.path);
  Picture picture = renderer.render(shot.camera, shot_idx, context);
  if (!stage.world.high_dynamic_range)
    for (float& value : picture.rgb.data()) value *= light.exposure;
  add_sensor_noise(picture.rgb, options.noise, shot_idx, options.seed);
  return picture;
}

bool nothing_between(const RayScene& scene, const Vector3d& point, const Vector3d& centre) {
  const Vector3f to_camera = (centre - point).cast<float>();
  return !scene.occluded(point.cast<float>(), to_camera, 1e-4f, 1);
}

std::vector<PinholeCamera> cameras_of(const World& world) {
  std::vector<PinholeCamera> cameras;
  for (const Shot& shot : world.shots) cameras.push_back(shot.camera);
  return cameras;
}

std::vector<SparsePoint> points_of(const Stage& stage, int shot_idx, const Picture& picture,
                                   const std::vector<PinholeCamera>& cameras, const SynthOptions& options) {
  const SurfaceQueries queries{[&](const Vector3d& point, const Vector3d& centre) {
                                 return nothing_between(*stage.lasting, point, centre);
                               },
                               [&](const Vector3d&, int x, int y) -> Vector3f {
                                 return Eigen::Map<const Vector3f>(picture.rgb.pixel(x, y));
                               }};
  const int quota = points_asked_of(shot_idx, static_cast<int>(cameras.size()), options.points);
  return points_of_image(shot_idx, quota, picture.depth, cameras, queries, options.seed);
}

SyntheticCameras describe(const Stage& stage, const std::vector<PinholeCamera>& cameras) {
  const World& world = stage.world;
  SyntheticCameras set;
  set.bounds = world.bounds;
  set.image_suffix = world.high_dynamic_range ? ".exr" : ".png";
  set.masked = world.masked;
  set.with_surfaces = true;
  set.with_transients = !stage.passing.empty();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Shot& shot = world.shots[i];
    const WorldLight& light = stage.light(shot.occasion);
    SyntheticFrame frame{shot.name, cameras[i], {}, {}, light.name};
    if (world.occasions_are_nodes) frame.node = shot.occasion;
    if (light.time_utc_s) {
      frame.time_utc = utc_text(*light.time_utc_s);
      set.place = SyntheticCameras::Place{kWorldLatitudeDeg, kWorldLongitudeDeg};
    }
    set.frames.push_back(std::move(frame));
  }
  return set;
}

}  // namespace

SynthSummary write_world(const fs::path& folder, WorldKind kind, const SynthOptions& options,
                         const WorldWriters& writers, RunContext& context) {
  const WorldDefaults defaults = world_defaults(kind);
  const WorldRequest request = checked_request(defaults, options);
  const LightKind light = options.light.value_or(defaults.light);
  context.throw_if_cancelled();
  const Stage stage = set_stage(kind, request, options, light, context);
  make_folders(folder, stage);
  write_lights(folder, stage.lights, writers);

  const std::vector<PinholeCamera> cameras = cameras_of(stage.world);
  const int count = static_cast<int>(cameras.size());
  std::vector<std::vector<SparsePoint>> points(count);
  std::atomic<int> done{0};
  parallel_for(count, context.thread_count(), [&](std::int64_t index, int) {
    const int i = static_cast<int>(index);
    const Picture picture = photograph(stage, i, options, context);
    write_pixels(folder, stage.world.shots[i].name, picture, stage, writers);
    points[i] = points_of(stage, i, picture, cameras, options);
    Progress progress;
    progress.stage = "photographs";
    progress.fraction = static_cast<double>(++done) / count;
    context.report(progress);
  });

  std::vector<SparsePoint> all;
  for (auto& part : points) std::move(part.begin(), part.end(), std::back_inserter(all));
  write_text_atomically(folder / "mesh.ply", ply_bytes(stage.world.mesh));
  write_text_atomically(folder / "illumination.json", illumination_json(stage.world, stage.lights));
  const SyntheticCameras told = describe(stage, with_pose_noise(cameras, options.pose_noise, options.seed));
  write_synthetic_colmap(folder, told, all);
  if (options.pose_noise.any())
    write_synthetic_transforms(folder / "transforms_true.json", describe(stage, cameras));
  write_synthetic_transforms(folder / "transforms.json", told);
  return {count,
          request.width,
          request.height,
          light,
          static_cast<int>(stage.world.times_utc_s.size()),
          stage.world.mesh.triangles.size(),
          all.size()};
}

}  // namespace roxel

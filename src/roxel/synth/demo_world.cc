#include "roxel/synth/demo_world.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/synth/dataset_text.h"
#include "roxel/synth/sparse_points.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kRingRadius = 5.2;
const Vector3d kTarget(0, 0, 0.36);

void require_demo(const char* field, int value, int low, int high) {
  if (value >= low && value <= high) return;
  throw_invalid(std::string("demo world: ") + field, std::to_string(value),
                std::to_string(low) + " to " + std::to_string(high));
}

void check(const DemoWorldOptions& options) {
  require_demo("images", options.images, 2, 999);
  require_demo("width", options.width, 16, 16384);
  require_demo("height", options.height, 16, 16384);
  require_demo("samples_per_axis", options.samples_per_axis, 1, 8);
  require_demo("points", options.points, 0, 1000000);
}

/// The camera at `centre` that sees the target in the image's middle, up being up.
PinholeCamera looking_at_target(const Vector3d& centre, const DemoWorldOptions& options) {
  const Vector3d forward = (kTarget - centre).normalized();
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  PinholeCamera camera;
  camera.pose.centre = centre;
  camera.pose.rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  const double focal = 1.68 * std::min(options.width, options.height);
  camera.intrinsics = {options.width,       options.height,       focal, focal,
                       options.width / 2.0, options.height / 2.0, 0};
  return camera;
}

void add_ring(std::vector<PinholeCamera>& cameras, int count, double elevation_deg, double first_turn,
              const DemoWorldOptions& options) {
  const double elevation = elevation_deg * std::numbers::pi / 180;
  for (int i = 0; i < count; ++i) {
    const double azimuth = 2 * std::numbers::pi * (i + first_turn) / count;
    const Vector3d direction(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                             std::sin(elevation));
    cameras.push_back(looking_at_target(kTarget + kRingRadius * direction, options));
  }
}

std::string photograph_name(int image_idx) {
  char name[16];
  std::snprintf(name, sizeof name, "%03d", image_idx);
  return name;
}

SurfaceQueries queries(const DemoRenderer& renderer) {
  return {[&](const Vector3d& point, const Vector3d& centre) {
            return renderer.visible(point.cast<float>(), centre.cast<float>());
          },
          [&](const Vector3d& point, int, int) { return renderer.shade(point.cast<float>()); }};
}

void write_pixels(const fs::path& folder, const std::string& name, const DemoPicture& picture,
                  const DemoWorldWriters& writers) {
  writers.photograph(folder / "images" / (name + ".png"), picture.rgb);
  writers.mask(folder / "mask" / (name + ".png"), picture.mask);
  writers.depth(folder / "depth" / (name + ".exr"), picture.depth);
}

void make_folders(const fs::path& folder) {
  for (const char* name : {"images", "mask", "depth"}) {
    std::error_code error;
    fs::create_directories(folder / name, error);
    if (error) throw IoError((folder / name).string() + ": cannot be made: " + error.message());
  }
}

}  // namespace

DemoBackground parse_demo_background(const std::string& text, const std::string& where) {
  if (text == "black") return DemoBackground::kBlack;
  if (text == "sky") return DemoBackground::kSky;
  throw_invalid(where, "'" + text + "'", "black or sky");
}

std::vector<PinholeCamera> demo_cameras(const DemoWorldOptions& options) {
  check(options);
  std::vector<PinholeCamera> cameras;
  const int below = options.images / 4, above = options.images / 3;
  add_ring(cameras, options.images - below - above, 14, 0.0, options);
  add_ring(cameras, above, 42, 0.5, options);
  add_ring(cameras, below, -14, 0.25, options);
  return cameras;
}

Eigen::AlignedBox3d demo_bounds() {
  return {DemoScene::bounds().min().cast<double>(), DemoScene::bounds().max().cast<double>()};
}

void write_demo_world(const fs::path& folder, const DemoWorldOptions& options,
                      const DemoWorldWriters& writers, RunContext& context) {
  const std::vector<PinholeCamera> cameras = demo_cameras(options);
  SyntheticCameras set;
  set.bounds = demo_bounds();
  for (int i = 0; i < options.images; ++i) set.frames.push_back({photograph_name(i), cameras[i], {}});
  const DemoScene scene(options.seed);
  const DemoRenderer renderer(scene, options.background, options.samples_per_axis);
  make_folders(folder);

  std::vector<std::vector<SparsePoint>> points(options.images);
  std::atomic<int> done{0};
  parallel_for(options.images, context.thread_count(), [&](std::int64_t index, int) {
    const int i = static_cast<int>(index);
    const DemoPicture picture = renderer.render(cameras[i], context);
    write_pixels(folder, set.frames[i].name, picture, writers);
    points[i] = points_of_image(i, points_asked_of(i, options.images, options.points), picture.depth, cameras,
                                queries(renderer), options.seed);
    Progress progress;
    progress.stage = "photographs";
    progress.fraction = static_cast<double>(++done) / options.images;
    context.report(progress);
  });

  std::vector<SparsePoint> all;
  for (auto& part : points) std::move(part.begin(), part.end(), std::back_inserter(all));
  write_synthetic_colmap(folder, set, all);
  write_synthetic_transforms(folder / "transforms.json", set);
}

}  // namespace roxel

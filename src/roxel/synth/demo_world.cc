#include "roxel/synth/demo_world.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/color/color_space.h"
#include "roxel/synth/demo_files.h"
#include "roxel/synth/noise.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kRingRadius = 5.2;
const Vector3d kTarget(0, 0, 0.36);

void require(const char* field, int value, int low, int high) {
  if (value >= low && value <= high) return;
  throw_invalid(std::string("demo world: ") + field, std::to_string(value),
                std::to_string(low) + " to " + std::to_string(high));
}

void check(const DemoWorldOptions& options) {
  require("images", options.images, 2, 999);
  require("width", options.width, 16, 16384);
  require("height", options.height, 16, 16384);
  require("samples_per_axis", options.samples_per_axis, 1, 8);
  require("points", options.points, 0, 1000000);
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

std::array<std::uint8_t, 3> display_code(const Vector3f& rgb) {
  std::array<std::uint8_t, 3> code;
  for (int c = 0; c < 3; ++c)
    code[c] = static_cast<std::uint8_t>(std::lround(255 * srgb_encode(std::clamp(rgb[c], 0.0f, 1.0f))));
  return code;
}

std::vector<SparsePoint::Observation> observations(const Vector3d& point, const DemoRenderer& renderer,
                                                   const std::vector<PinholeCamera>& cameras) {
  std::vector<SparsePoint::Observation> seen;
  for (int i = 0; i < static_cast<int>(cameras.size()); ++i) {
    const Intrinsics& k = cameras[i].intrinsics;
    const Vector3d pixel = cameras[i].project(point);
    const bool inside =
        pixel.z() > 0 && pixel.x() > 0 && pixel.y() > 0 && pixel.x() < k.width && pixel.y() < k.height;
    if (inside && renderer.visible(point.cast<float>(), cameras[i].pose.centre.cast<float>()))
      seen.push_back({i, pixel.head<2>()});
  }
  return seen;
}

/// Points at random pixels of one image that show a surface.
std::vector<SparsePoint> points_of_image(int image_idx, int count, const Image& depth,
                                         const DemoRenderer& renderer,
                                         const std::vector<PinholeCamera>& cameras, std::uint32_t seed) {
  std::vector<SparsePoint> points;
  for (int attempt = 0; attempt < 20 * count && static_cast<int>(points.size()) < count; ++attempt) {
    const int x = static_cast<int>(lattice_hash(attempt, image_idx, 0, seed) % depth.width());
    const int y = static_cast<int>(lattice_hash(attempt, image_idx, 1, seed) % depth.height());
    const float z = *depth.pixel(x, y);
    if (!(z > 0)) continue;
    const Ray ray = cameras[image_idx].ray(x + 0.5, y + 0.5);
    const Vector3d position = ray.origin + z * ray.direction;
    auto seen = observations(position, renderer, cameras);
    if (seen.size() < 2) continue;
    points.push_back({position, display_code(renderer.shade(position.cast<float>())), std::move(seen)});
  }
  return points;
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
  const SyntheticCameras set{demo_cameras(options), demo_bounds()};
  const DemoScene scene(options.seed);
  const DemoRenderer renderer(scene, options.background, options.samples_per_axis);
  make_folders(folder);

  std::vector<std::vector<SparsePoint>> points(options.images);
  std::atomic<int> done{0};
  parallel_for(options.images, context.thread_count(), [&](std::int64_t index, int) {
    const int i = static_cast<int>(index);
    const DemoPicture picture = renderer.render(set.cameras[i], context);
    write_pixels(folder, synthetic_name(i), picture, writers);
    // The rest of the division goes to the first images, so that all are asked for.
    const int quota = options.points / options.images + (i < options.points % options.images);
    points[i] = points_of_image(i, quota, picture.depth, renderer, set.cameras, options.seed);
    Progress progress;
    progress.stage = "photographs";
    progress.fraction = static_cast<double>(++done) / options.images;
    context.report(progress);
  });

  std::vector<SparsePoint> all;
  for (auto& part : points) std::move(part.begin(), part.end(), std::back_inserter(all));
  write_synthetic_colmap(folder, set, all);
  write_synthetic_transforms(folder, set);
}

}  // namespace roxel

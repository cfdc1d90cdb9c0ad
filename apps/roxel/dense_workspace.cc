#include "dense_workspace.h"
#include "common.h"

#include <atomic>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/depth/propagate_depth.h"
#include "roxel/io/colmap_dense.h"
#include "roxel/io/depth_file.h"
#include "roxel/io/image_file.h"
#include "roxel/report/pictures.h"
#include "roxel/report/run_record.h"
#include "roxel/surface/depth_fusion.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kStride = 8;             ///< pixels between those that become points
constexpr double kSameSurface = 0.02;  ///< relative difference of depth

/// What another view needs to know of a view's depth: one pixel in kStride^2.
struct ThinDepth {
  int width = 0, height = 0;
  std::vector<float> depth;
  float at(int x, int y) const { return depth[static_cast<std::size_t>(y / kStride) * width + x / kStride]; }
};

ThinDepth thinned(const Image& depth) {
  ThinDepth thin;
  thin.width = (depth.width() + kStride - 1) / kStride;
  thin.height = (depth.height() + kStride - 1) / kStride;
  for (int y = 0; y < thin.height; ++y)
    for (int x = 0; x < thin.width; ++x)
      thin.depth.push_back(*depth.pixel(std::min(kStride * x + kStride / 2, depth.width() - 1),
                                        std::min(kStride * y + kStride / 2, depth.height() - 1)));
  return thin;
}

/// The best depth, 0 where none, and normals in the camera.
struct DenseMaps {
  Image depth, normal;
};

DenseMaps dense_maps(const DepthLayers& layers, const PinholeCamera& camera, double voxel_size) {
  DenseMaps maps;
  DepthEstimates best = best_estimates(layers);
  maps.depth = std::move(best.depth);
  maps.normal = Image(maps.depth.width(), maps.depth.height(), 3);
  PlaneMap fitted;
  const double focal = 0.5 * (camera.intrinsics.fx + camera.intrinsics.fy);
  if (layers.normal.empty())
    fitted = fit_planes(maps.depth, best.variance, focal, plane_radius(maps.depth, focal, voxel_size));
  for (int y = 0; y < maps.depth.height(); ++y)
    for (int x = 0; x < maps.depth.width(); ++x) {
      if (!(*maps.depth.pixel(x, y) > 0)) continue;
      Eigen::Vector3d world;
      if (layers.normal.empty()) {
        world = world_normal(camera, fitted.at(x, y), x + 0.5, y + 0.5);
      } else {
        const float* n = layers.normal.pixel(x, y);
        world = {n[0], n[1], n[2]};
      }
      const Eigen::Vector3d in_camera = camera.pose.rotation * world;
      for (int c = 0; c < 3; ++c) maps.normal.pixel(x, y)[c] = static_cast<float>(in_camera[c]);
    }
  return maps;
}

/// Points that views share, from their thinned depth.
std::vector<TrackedPoint> shared_points(const Dataset& dataset, const std::vector<ThinDepth>& thin) {
  std::vector<TrackedPoint> points;
  for (std::size_t v = 0; v < thin.size(); ++v)
    for (int ty = 0; ty < thin[v].height; ++ty)
      for (int tx = 0; tx < thin[v].width; ++tx) {
        const float z = thin[v].depth[static_cast<std::size_t>(ty) * thin[v].width + tx];
        if (!(z > 0)) continue;
        const Eigen::Vector2d pixel(kStride * tx + kStride / 2 + 0.5, kStride * ty + kStride / 2 + 0.5);
        const Ray ray = dataset.views[v].camera.ray(pixel.x(), pixel.y());
        TrackedPoint point{ray.origin + z * ray.direction, {{static_cast<int>(v), pixel}}};
        for (std::size_t s = 0; s < thin.size(); ++s) {
          if (s == v) continue;
          const PinholeCamera& camera = dataset.views[s].camera;
          const Eigen::Vector3d seen = camera.project(point.position);
          if (!(seen.z() > 0) || !(seen.x() >= 0) || !(seen.y() >= 0) ||
              !(seen.x() < camera.intrinsics.width) || !(seen.y() < camera.intrinsics.height))
            continue;
          const float other = thin[s].at(static_cast<int>(seen.x()), static_cast<int>(seen.y()));
          if (std::abs(other - seen.z()) < kSameSurface * seen.z())
            point.sightings.emplace_back(static_cast<int>(s), seen.head<2>());
        }
        if (point.sightings.size() > 1) points.push_back(std::move(point));
      }
  return points;
}

}  // namespace

void write_dense_workspace(Dataset dataset, const PhotographLoader& load, const fs::path& run,
                           const fs::path& results, double white, double voxel_size, RunContext& context) {
  for (const View& view : dataset.views)
    if (!fs::is_regular_file(depth_path(run, view.name)))
      throw_invalid(run.string(), "no depth/" + view.name + ".exr",
                    "a run with depth maps (roxel reconstruct without --no-depth, or roxel depth)");
  std::vector<ThinDepth> thin(dataset.views.size());
  std::atomic<int> done{0};
  std::atomic<bool> any{false};
  parallel_for(dataset.views.size(), context.thread_count(), [&](std::int64_t v, int) {
    context.throw_if_cancelled();
    View& view = dataset.views[v];
    const fs::path file = depth_path(run, view.name);
    const DepthLayers layers = read_depth(file);
    if (layers.depth.width() != view.camera.intrinsics.width ||
        layers.depth.height() != view.camera.intrinsics.height)
      throw_invalid(file.string(), "another size than the image's", "depth maps of this data set");
    const fs::path image = fs::absolute(view_path(results, "images", view.name, ".png"));
    write_png(image.string(), encoded_picture(load(view).rgb, white, {}), kAsItIs);
    view.image_path = image.string();
    const DenseMaps maps = dense_maps(layers, view.camera, voxel_size);
    write_colmap_map(colmap_map_path(results, "depth", view), maps.depth);
    write_colmap_map(colmap_map_path(results, "normal", view), maps.normal);
    thin[v] = thinned(maps.depth);
    for (const float z : maps.depth.data())
      if (z > 0) any = true;
    Progress progress;
    progress.stage = "dense workspace";
    progress.fraction = ++done / static_cast<double>(dataset.views.size());
    context.report(progress);
  });
  if (!any) {
    std::error_code ignored;
    fs::remove_all(results / "stereo", ignored);
    fs::remove_all(results / "images", ignored);
    fs::remove(results, ignored);  // where nothing else is in it
    throw NoSurface((run / "depth").string() +
                    ": found no pixel with depth in any view, expected depth maps of a surface");
  }
  write_colmap_workspace(dataset, shared_points(dataset, thin), results);
}

}  // namespace roxel::cli

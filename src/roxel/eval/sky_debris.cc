#include "roxel/eval/sky_debris.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/eval/surface_distance.h"
#include "roxel/eval/surface_sight.h"
#include "roxel/surface/mesh_rays.h"

namespace roxel {
namespace {

bool before_sky(const MeshRays& rays, const Eigen::Vector3d& x, double voxel_size,
                std::span<const PinholeCamera> cameras) {
  return std::any_of(cameras.begin(), cameras.end(), [&](const PinholeCamera& camera) {
    const auto misses = [&](const Eigen::Vector3d& at) {
      return !rays.trace(camera.pose.centre, at - camera.pose.centre);
    };
    if (!in_image(camera, x) || !misses(x)) return false;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d side(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
      if (!misses(x + voxel_size * side)) return false;
    }
    return true;
  });
}

double highest(const Mesh& surface, const Eigen::Vector3d& up) {
  double height = -std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& point : surface.points) height = std::max(height, up.dot(point));
  return height;
}

void add(VoxelSum& sum, float opacity) {
  ++sum.voxels;
  sum.opacity += opacity;
}

}  // namespace

std::vector<SkyStand> sky_stands(const Mesh& surface, std::span<const Eigen::Vector3d> places,
                                 std::span<const PinholeCamera> cameras, const SkyDebrisOptions& options,
                                 int threads) {
  constexpr std::int64_t kGrain = 256;
  ROXEL_CHECK(!surface.is_point_set());
  const SurfaceDistance distance(surface);
  const MeshRays rays(surface);
  const double limit = std::nextafter(options.clearance, std::numeric_limits<double>::infinity());
  const double top = highest(surface, options.up);
  std::vector<SkyStand> stands(places.size());
  parallel_for_blocks(static_cast<std::int64_t>(places.size()), kGrain, threads,
                      [&](std::int64_t begin, std::int64_t end, int) {
                        for (std::int64_t i = begin; i < end; ++i)
                          if (std::isinf(distance(places[i], limit)))
                            stands[i] = {!rays.trace(places[i], options.up), options.up.dot(places[i]) > top,
                                         before_sky(rays, places[i], options.voxel_size, cameras)};
                      });
  return stands;
}

double SkyDebris::share(const VoxelSum& part) const {
  return all.voxels > 0 ? static_cast<double>(part.voxels) / static_cast<double>(all.voxels) : 0.0;
}
double SkyDebris::share_of_opacity(const VoxelSum& part) const {
  return all.opacity > 0 ? part.opacity / all.opacity : 0.0;
}

SkyDebris sky_debris(std::span<const float> opacity, std::span<const SkyStand> stands,
                     double opacity_threshold) {
  ROXEL_CHECK_EQ(opacity.size(), stands.size());
  SkyDebris debris;
  debris.opacity_threshold = opacity_threshold;
  for (std::size_t i = 0; i < opacity.size(); ++i) {
    if (opacity[i] < static_cast<float>(opacity_threshold)) continue;
    add(debris.all, opacity[i]);
    if (stands[i].in_the_open) add(debris.in_the_open, opacity[i]);
    if (stands[i].above_all) add(debris.above_all, opacity[i]);
    if (stands[i].before_sky) add(debris.before_sky, opacity[i]);
  }
  return debris;
}

}  // namespace roxel

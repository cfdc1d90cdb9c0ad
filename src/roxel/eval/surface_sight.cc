#include "roxel/eval/surface_sight.h"

#include "roxel/base/parallel.h"
#include "roxel/surface/mesh_rays.h"

namespace roxel {

bool in_image(const PinholeCamera& camera, const Eigen::Vector3d& x) {
  const Eigen::Vector3d uvz = camera.project(x);
  return uvz.z() > 0 && uvz.x() >= 0 && uvz.x() < camera.intrinsics.width && uvz.y() >= 0 &&
         uvz.y() < camera.intrinsics.height;
}

std::vector<int> count_sightings(const Mesh& surface, std::span<const Eigen::Vector3d> points,
                                 std::span<const PinholeCamera> cameras, int threads) {
  constexpr std::int64_t kGrain = 1024;
  const MeshRays rays(surface);
  std::vector<int> counts(points.size());
  parallel_for_blocks(static_cast<std::int64_t>(points.size()), kGrain, threads,
                      [&](std::int64_t begin, std::int64_t end, int) {
                        for (std::int64_t i = begin; i < end; ++i)
                          for (const PinholeCamera& camera : cameras)
                            counts[i] += in_image(camera, points[i]) &&
                                         rays.sees(camera.pose.centre, points[i], kSightMargin);
                      });
  return counts;
}

}  // namespace roxel

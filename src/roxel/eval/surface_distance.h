#pragma once
/// How far points are from a surface: exact distances, found through Embree's bounding volume hierarchy.

#include <limits>
#include <memory>
#include <span>

#include "roxel/surface/mesh.h"

namespace roxel {

/// Distances to a mesh's triangles, or to its points where it has no triangles. May be asked from several
/// threads at once. Answers are computed in double precision, and are the same for any number of threads.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(Mesh mesh);
  ~SurfaceDistance();
  SurfaceDistance(SurfaceDistance&&) noexcept;
  SurfaceDistance& operator=(SurfaceDistance&&) noexcept;

  /// To the nearest place on the surface, world units; infinity where none is nearer than `limit`, or the
  /// mesh is empty.
  double operator()(const Eigen::Vector3d& x, double limit = std::numeric_limits<double>::infinity()) const;
  /// The same for many points.
  std::vector<double> of(std::span<const Eigen::Vector3d> points, int threads) const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

/// The place on triangle a, b, c (its corners may coincide) that is nearest to x: [Ericson04] section 5.1.5.
Eigen::Vector3d closest_on_triangle(const Eigen::Vector3d& x, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace roxel

#pragma once
/// First hits of rays on triangle meshes, by Embree.

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "roxel/synth/triangle_mesh.h"

namespace roxel {

struct RayHit {
  float distance;          ///< in lengths of the ray's direction
  Eigen::Vector3f normal;  ///< of the triangle, unit, on the side that the ray came from
  int material;
  bool extra;  ///< the mesh of what stands here for a while was hit
};

/// Thread safe once made.
class RayScene {
 public:
  /// What stands for good, and what else there is at the moment (may be empty). Throws NumericalError where
  /// Embree cannot build.
  explicit RayScene(const TriangleMesh& mesh, const TriangleMesh& extra = {});
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  std::optional<RayHit> trace(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                              float near = 0) const;
  /// Whether anything is between `near` and `far` lengths of the direction.
  bool occluded(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float near, float far) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace roxel

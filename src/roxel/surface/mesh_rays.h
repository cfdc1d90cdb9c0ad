#pragma once
/// First hits of rays on a mesh, by Embree: for what a view sees of a surface, and for pictures of it.

#include <memory>
#include <optional>

#include "roxel/surface/mesh.h"

namespace roxel {

struct MeshHit {
  double distance = 0;  ///< in lengths of the ray's direction
  std::uint32_t triangle = 0;
  std::array<double, 3> corners{};  ///< weights of the triangle's corners at the hit, sum 1
};

/// Thread safe once made. Works in floats about the mesh's centre.
class MeshRays {
 public:
  /// Takes what it needs of the mesh. Throws NumericalError where Embree cannot build.
  explicit MeshRays(const Mesh& mesh);
  ~MeshRays();
  MeshRays(const MeshRays&) = delete;
  MeshRays& operator=(const MeshRays&) = delete;

  std::optional<MeshHit> trace(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  /// Whether nothing is on the way from `eye` to `x`, the last `margin` (a share of the way) left out.
  bool sees(const Eigen::Vector3d& eye, const Eigen::Vector3d& x, double margin) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace roxel

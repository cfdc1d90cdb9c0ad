#pragma once
/// Adds simple shapes to a mesh, each through the builder's present placement and in its present material.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <span>
#include <vector>

#include "roxel/synth/triangle_mesh.h"

namespace roxel {

class MeshBuilder {
 public:
  /// The mesh must outlive the builder.
  explicit MeshBuilder(TriangleMesh& mesh) : mesh_(mesh) {}

  /// What follows is made of this material.
  void use(int material) { material_ = static_cast<std::uint16_t>(material); }
  /// What follows is moved by this transform into the world.
  void place(const Eigen::Affine3f& world_from_object) { world_from_object_ = world_from_object; }

  void triangle(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c);
  /// Corners in turn around a plane convex quadrangle.
  void quad(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
            const Eigen::Vector3f& d);
  void box(const Eigen::Vector3f& low, const Eigen::Vector3f& high);

  /// How a grid's two directions end: open, or closed to a ring.
  struct Rings {
    bool u = false, v = false;
  };
  /// A surface sampled at nu x nv cells; `point` takes u and v in [0, 1].
  void surface(int nu, int nv, const std::function<Eigen::Vector3f(float u, float v)>& point, Rings rings);
  void surface(int nu, int nv, const std::function<Eigen::Vector3f(float u, float v)>& point) {
    surface(nu, nv, point, Rings{});
  }

  /// A profile of points (radius, z) turned about the Z axis.
  void lathe(std::span<const Eigen::Vector2f> profile, int segments);
  /// A round rod along a path of at least two points, with flat ends.
  void tube(std::span<const Eigen::Vector3f> path, float radius, int segments);
  void cylinder(const Eigen::Vector3f& from, const Eigen::Vector3f& to, float radius, int segments);
  void ellipsoid(const Eigen::Vector3f& centre, const Eigen::Vector3f& radii, int segments);

 private:
  std::uint32_t vertex(const Eigen::Vector3f& p);
  void face(std::uint32_t a, std::uint32_t b, std::uint32_t c);

  TriangleMesh& mesh_;
  Eigen::Affine3f world_from_object_ = Eigen::Affine3f::Identity();
  std::uint16_t material_ = 0;
};

/// Points of a smooth curve through `knots` [CatmullRom74], `steps` between each two.
std::vector<Eigen::Vector2f> smooth_profile(std::span<const Eigen::Vector2f> knots, int steps);

/// Moves by `offset` after a turn about the Z axis.
Eigen::Affine3f placed(const Eigen::Vector3f& offset, float turn_rad = 0);

}  // namespace roxel

#pragma once
/// Surfaces as triangles or points in world coordinates, and points drawn on them.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

namespace roxel {

/// A triangle soup, or a set of points where it has no triangles. Orientation and connection mean nothing.
struct Mesh {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into points

  bool is_point_set() const { return triangles.empty(); }
};

/// Summed area of all triangles, world units squared.
double surface_area(const Mesh& mesh);

struct SurfaceSampling {
  std::int64_t count = 100000;  ///< points wanted; fewer come back where hardly any surface is in the box
  std::uint64_t seed = 1;
  Eigen::AlignedBox3d box;  ///< only points in it; empty (the default) = everywhere
};

/// Points drawn uniformly by area on the triangles that reach into the box. The same for a seed everywhere.
/// None where the mesh has no area in the box.
std::vector<Eigen::Vector3d> sample_surface(const Mesh& mesh, const SurfaceSampling& options);

/// The mesh's points that are in the box; an empty box takes all.
std::vector<Eigen::Vector3d> points_in_box(const std::vector<Eigen::Vector3d>& points,
                                           const Eigen::AlignedBox3d& box);

/// The first point of every cell of a grid of that width, in the order of the points: what dense and sparse
/// parts weigh then is their extent.
std::vector<Eigen::Vector3d> one_point_a_cell(const std::vector<Eigen::Vector3d>& points, double cell_size);

}  // namespace roxel

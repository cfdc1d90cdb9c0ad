#pragma once
/// A surface with an outside, and what each of its points looks like.

#include "roxel/surface/mesh.h"

namespace roxel {

/// Corners of triangles run counterclockwise seen from outside, and triangles that touch share corners.
/// Attributes are one a point, or empty.
struct Surface {
  Mesh mesh;
  std::vector<Eigen::Vector3f> normals;      ///< unit, to the outside
  std::vector<std::array<float, 3>> colors;  ///< linear RGB, 1 = white
};

/// Normals of the points: those of their triangles, weighted by the angle at the point [Thuermer98]. Zero
/// where a point has no triangle with an area.
std::vector<Eigen::Vector3f> point_normals(const Mesh& mesh);

/// The triangles for which `keep` is not 0, and the points that they use, all in their old order. Attributes
/// follow. `keep` has an entry a triangle.
Surface kept_triangles(const Surface& surface, const std::vector<std::uint8_t>& keep);

/// Up to three triangles that share an edge with a triangle, -1 where there is none; entry k is over the edge
/// from corner k to corner k + 1. Where more than two share an edge, they are joined in pairs.
using FaceNeighbours = std::vector<std::array<std::int32_t, 3>>;
FaceNeighbours face_neighbours(const Mesh& mesh);

/// Parts of a surface that hang together by points, numbered in the order of their first triangles.
struct Components {
  std::vector<std::uint32_t> of_triangle;
  std::uint32_t count = 0;
};
/// Of the triangles for which `among` is not 0 (empty: all); others get the number kNoComponent.
Components connected_components(const Mesh& mesh, const std::vector<std::uint8_t>& among = {});
inline constexpr std::uint32_t kNoComponent = 0xffffffffu;

}  // namespace roxel

#pragma once
/// Triangles with shared corners and a material each: what synthetic worlds are made of.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace roxel {

/// A polygon soup; neither closed nor oriented, surfaces are seen from both sides.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint16_t> materials;  ///< of each triangle: index into the world's materials

  /// The smallest box around all vertices; empty without any.
  Eigen::AlignedBox3f bounds() const;
};

/// A binary little-endian PLY file: float x, y, z and triangles as lists of indices.
std::string ply_bytes(const TriangleMesh& mesh);

}  // namespace roxel

#include "roxel/synth/triangle_mesh.h"

#include <bit>
#include <cstring>

namespace roxel {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY files are written as numbers lie in memory");

template <class T>
void append_bytes(std::string& bytes, const T& value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

}  // namespace

Eigen::AlignedBox3f TriangleMesh::bounds() const {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& vertex : vertices) box.extend(vertex);
  return box;
}

std::string ply_bytes(const TriangleMesh& mesh) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.vertices.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
      std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    for (int i = 0; i < 3; ++i) append_bytes(bytes, vertex[i]);
  for (const auto& triangle : mesh.triangles) {
    append_bytes(bytes, std::uint8_t{3});
    for (std::uint32_t corner : triangle) append_bytes(bytes, corner);
  }
  return bytes;
}

}  // namespace roxel

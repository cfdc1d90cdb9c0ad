#include "roxel/io/surface_ply.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/color/color_space.h"

namespace roxel {
namespace {

static_assert(std::endian::native == std::endian::little, "rows are written as they lie in memory");

class Rows {
 public:
  template <class T>
  void add(const T& value) {
    const auto* bytes = reinterpret_cast<const char*>(&value);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof value);
  }
  const std::vector<char>& bytes() const { return bytes_; }

 private:
  std::vector<char> bytes_;
};

std::string header(const Surface& surface, const char* number) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment roxel: surface\nelement vertex " +
                     std::to_string(surface.mesh.points.size()) + "\n";
  for (const char* axis : {"x", "y", "z"}) text += std::string("property ") + number + " " + axis + "\n";
  if (!surface.normals.empty()) text += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!surface.colors.empty()) text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  return text + "element face " + std::to_string(surface.mesh.triangles.size()) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

void add_color(const std::array<float, 3>& linear, Rows& rows) {
  for (const float value : linear)
    rows.add(static_cast<std::uint8_t>(std::lround(255 * std::clamp(srgb_encode(value), 0.0f, 1.0f))));
}

Rows rows_of(const Surface& surface, bool doubles) {
  Rows rows;
  for (std::size_t i = 0; i < surface.mesh.points.size(); ++i) {
    for (const double x : surface.mesh.points[i]) doubles ? rows.add(x) : rows.add(static_cast<float>(x));
    if (!surface.normals.empty())
      for (const float n : surface.normals[i]) rows.add(n);
    if (!surface.colors.empty()) add_color(surface.colors[i], rows);
  }
  for (const auto& triangle : surface.mesh.triangles) {
    rows.add(std::uint8_t{3});
    for (const std::uint32_t corner : triangle) rows.add(static_cast<std::int32_t>(corner));
  }
  return rows;
}

}  // namespace

bool floats_are_too_coarse(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& x : mesh.points) box.extend(x);
  if (box.isEmpty()) return false;
  const double largest = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  return largest * 0x1p-24 > 1e-6 * box.diagonal().norm();
}

void write_surface_ply(const std::filesystem::path& path, const Surface& surface) {
  const bool doubles = floats_are_too_coarse(surface.mesh);
  const Rows rows = rows_of(surface, doubles);
  write_file_atomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    file << header(surface, doubles ? "double" : "float");
    file.write(rows.bytes().data(), static_cast<std::streamsize>(rows.bytes().size()));
    if (!file.flush()) throw IoError(path.string() + ": cannot write (disc full?)");
  });
}

}  // namespace roxel

#include "roxel/eval/section.h"

#include <cmath>

#include "roxel/base/error.h"

namespace roxel {
namespace {

/// The axes that go right and up in the picture.
constexpr int kRight[3] = {1, 0, 0};
constexpr int kUp[3] = {2, 2, 1};

/// The end of an edge's crossing with the plane at height 0, from signed heights of unequal sign.
Eigen::Vector3d crossing(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double height_a,
                         double height_b) {
  return a + height_a / (height_a - height_b) * (b - a);
}

}  // namespace

Section opacity_section(const Volume& volume, int axis, double position) {
  ROXEL_CHECK(axis >= 0 && axis < 3);
  const BrickIndex& index = volume.index(0);
  const LatticeFrame& frame = index.frame();
  const Eigen::Vector3i size = frame.size_in_voxels();
  Section section{axis, position, frame.voxel_size, Image(size[kRight[axis]], size[kUp[axis]], 1)};
  Eigen::Vector3i voxel;
  voxel[axis] = static_cast<int>(std::floor((position - frame.origin[axis]) / frame.voxel_size));
  if (voxel[axis] < 0 || voxel[axis] >= size[axis]) return section;
  for (int up = 0; up < section.opacity.height(); ++up)
    for (int right = 0; right < section.opacity.width(); ++right) {
      voxel[kRight[axis]] = right;
      voxel[kUp[axis]] = up;
      const std::uint32_t slot = index.slot(voxel);
      if (slot == kNoSlot) continue;
      *section.opacity.pixel(right, section.opacity.height() - 1 - up) = alpha_from_tau(volume.tau[slot]);
    }
  return section;
}

std::vector<OutlinePiece> surface_outline(const Mesh& mesh, const Section& section,
                                          const LatticeFrame& frame) {
  const int axis = section.axis, right = kRight[axis], up = kUp[axis];
  const auto in_picture = [&](const Eigen::Vector3d& x) {
    const Eigen::Vector3d voxels = (x - frame.origin) / frame.voxel_size;
    return Eigen::Vector2d(voxels[right], section.opacity.height() - voxels[up]);
  };
  std::vector<OutlinePiece> outline;
  for (const auto& triangle : mesh.triangles) {
    std::vector<Eigen::Vector3d> ends;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d &a = mesh.points[triangle[k]], &b = mesh.points[triangle[(k + 1) % 3]];
      const double height_a = a[axis] - section.position, height_b = b[axis] - section.position;
      // A corner on the plane counts as above it, so that each crossing is found once.
      if ((height_a < 0) != (height_b < 0)) ends.push_back(crossing(a, b, height_a, height_b));
    }
    if (ends.size() == 2) outline.push_back({in_picture(ends[0]), in_picture(ends[1])});
  }
  return outline;
}

}  // namespace roxel

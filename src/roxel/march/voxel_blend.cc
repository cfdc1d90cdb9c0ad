#include "roxel/march/voxel_blend.h"

namespace roxel {

namespace {

/// Slots of the cube of cells that begins at `low`, x fastest; kNoSlot where there is no voxel.
void find_cube(const BrickIndex& index, const Eigen::Vector3i& low, std::array<std::uint32_t, 8>& slots) {
  const Eigen::Vector3i brick(low.x() >> 3, low.y() >> 3, low.z() >> 3);
  const Eigen::Vector3i in_brick = low - kBrickSide * brick;
  const bool in_one = low.minCoeff() >= 0 && in_brick.maxCoeff() < kBrickSide - 1 &&
                      (brick.array() < index.frame().size_in_bricks.array()).all();
  if (!in_one) {
    for (int i = 0; i < 8; ++i) slots[i] = index.slot(low + Eigen::Vector3i(i & 1, i >> 1 & 1, i >> 2));
    return;
  }
  slots.fill(kNoSlot);
  const std::int32_t found = index.brick_at(brick.x(), brick.y(), brick.z());
  if (found < 0) return;
  const Brick& voxels = index.bricks()[found];
  const int first = voxel_in_brick(in_brick.x(), in_brick.y(), in_brick.z());
  for (int i = 0; i < 8; i += 2) {  // both in a row: the second's slot follows the first's
    const int v = first + voxel_in_brick(0, i >> 1 & 1, i >> 2);
    const bool has_first = voxels.has(v), has_second = voxels.has(v + 1);
    if (!has_first && !has_second) continue;
    const std::uint32_t slot = voxels.slot(v);
    if (has_first) slots[i] = slot;
    if (has_second) slots[i + 1] = slot + has_first;
  }
}

}  // namespace

VoxelBlend blend_around(const BrickIndex& index, const Eigen::Vector3d& at) {
  const Eigen::Vector3d from_centre = at - Eigen::Vector3d::Constant(0.5);
  const Eigen::Vector3d low = from_centre.array().floor();
  const Eigen::Vector3f high_share = (from_centre - low).cast<float>();
  std::array<std::uint32_t, 8> slots;
  find_cube(index, low.cast<int>(), slots);
  VoxelBlend blend;
  float sum = 0;
  for (int i = 0; i < 8; ++i) {
    if (slots[i] == kNoSlot) continue;
    float weight = 1;
    for (int a = 0; a < 3; ++a) weight *= i >> a & 1 ? high_share[a] : 1 - high_share[a];
    blend.slot[blend.count] = slots[i];
    blend.weight[blend.count++] = weight;
    sum += weight;
  }
  for (int i = 0; i < blend.count; ++i) blend.weight[i] /= sum;
  return blend;
}

}  // namespace roxel

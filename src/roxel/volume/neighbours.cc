#include "roxel/volume/neighbours.h"

#include <algorithm>
#include <bit>

namespace roxel {
namespace {

// Along one axis, the voxels that the neighbour in direction d gives to the block: its near layer, or all.
struct Span {
  int first, last;
};
Span span(int d) {
  return d < 0 ? Span{kBrickSide - 1, kBrickSide - 1} : d > 0 ? Span{0, 0} : Span{0, kBrickSide - 1};
}

void copy_part(const Brick& brick, const float* channel, const Eigen::Vector3i& d, float* block) {
  const Span x = span(d.x()), y = span(d.y()), z = span(d.z());
  for (int k = z.first; k <= z.last; ++k)
    for (int j = y.first; j <= y.last; ++j) {
      const int first = voxel_in_brick(x.first, j, k);
      std::uint32_t left = (brick.word[first / 32] >> first % 32) & ((2u << (x.last - x.first)) - 1);
      if (left == 0) continue;
      const float* value = channel + brick.slot(first);  // of the row's first voxel from there on
      float* row = block + voxel_in_block(kBrickSide * d.x(), j + kBrickSide * d.y(), k + kBrickSide * d.z());
      for (; left != 0; left &= left - 1) row[x.first + std::countr_zero(left)] = *value++;
    }
}

}  // namespace

void gather_block(const BrickIndex& index, const float* channel, int brick_idx, float absent, float* block) {
  std::fill_n(block, kBlockVoxels, absent);
  const Eigen::Vector3i centre = index.bricks()[brick_idx].coord;
  const Eigen::Vector3i size = index.frame().size_in_bricks;
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const Eigen::Vector3i d(dx, dy, dz), at = centre + d;
        if ((at.array() < 0).any() || (at.array() >= size.array()).any()) continue;
        const std::int32_t neighbour = index.brick_at(at.x(), at.y(), at.z());
        if (neighbour >= 0) copy_part(index.bricks()[neighbour], channel, d, block);
      }
}

}  // namespace roxel

#pragma once
/// Bulk access to a voxel's neighbours: one brick together with the layer of voxels around it.

#include "roxel/volume/volume.h"

namespace roxel {

inline constexpr int kBlockSide = kBrickSide + 2;
inline constexpr int kBlockVoxels = kBlockSide * kBlockSide * kBlockSide;

/// Index in a gathered block of the brick's voxel (i, j, k): x fastest; i, j, k in [-1, 8].
inline int voxel_in_block(int i, int j, int k) {
  return (i + 1) + kBlockSide * ((j + 1) + kBlockSide * (k + 1));
}

/// Copies `channel` (one entry a slot, of the whole volume) for brick `brick_idx` and its neighbours into
/// block[kBlockVoxels]; `absent` where there is no voxel, beyond the lattice's box too.
void gather_block(const BrickIndex& index, const float* channel, int brick_idx, float absent, float* block);

}  // namespace roxel

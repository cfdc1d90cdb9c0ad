#include "roxel/volume/saved_voxels.h"

namespace roxel {

void for_each_saved_voxel(
    const Volume& volume, float opacity_threshold, float confidence_threshold,
    const std::function<void(std::uint32_t slot, const Eigen::Vector3d& centre, float opacity)>& visit) {
  if (volume.lattice_count() == 0) return;
  const BrickIndex& index = volume.index(0);
  for (const Brick& brick : index.bricks())
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (brick.local[v] == kNoVoxel) continue;
      const std::uint32_t slot = brick.first_slot + brick.local[v];
      const float alpha = alpha_from_tau(volume.tau[slot]);
      if (!(alpha >= opacity_threshold && volume.confidence[slot] >= confidence_threshold)) continue;
      const Eigen::Vector3i in_brick(v % kBrickSide, v / kBrickSide % kBrickSide,
                                     v / (kBrickSide * kBrickSide));
      visit(slot, index.frame().voxel_centre(kBrickSide * brick.coord + in_brick), alpha);
    }
}

}  // namespace roxel

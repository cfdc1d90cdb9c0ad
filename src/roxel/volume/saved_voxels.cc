#include "roxel/volume/saved_voxels.h"

namespace roxel {

void for_each_saved_voxel(
    const Volume& volume, float opacity_threshold, float confidence_threshold,
    const std::function<void(std::uint32_t slot, const Eigen::Vector3d& centre, float opacity)>& visit) {
  if (volume.lattice_count() == 0) return;
  const BrickIndex& index = volume.index(0);
  for (const Brick& brick : index.bricks())
    brick.for_each_voxel([&](int v, std::uint32_t slot) {
      const float alpha = alpha_from_tau(volume.tau[slot]);
      if (alpha >= opacity_threshold && volume.confidence[slot] >= confidence_threshold)
        visit(slot, index.frame().voxel_centre(voxel_of(brick, v)), alpha);
    });
}

}  // namespace roxel

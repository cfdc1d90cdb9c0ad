#pragma once
/// Which voxels count as part of what was reconstructed: those that voxels.ply holds.

#include <functional>

#include "roxel/volume/volume.h"

namespace roxel {

/// Calls visit(slot, centre in the world, opacity over one voxel length) for the voxels of lattice 0 whose
/// opacity and confidence reach both thresholds, in the order of slots.
void for_each_saved_voxel(
    const Volume& volume, float opacity_threshold, float confidence_threshold,
    const std::function<void(std::uint32_t slot, const Eigen::Vector3d& centre, float opacity)>& visit);

}  // namespace roxel

#pragma once
/// From voxels as they lie in memory to the arrays that matching works on.

#include "roxel/infer/evidence.h"
#include "roxel/infer/match.h"

namespace roxel {

/// Fills what the block takes from voxels for the first `count` entries: each voxel's cache line is read once
/// and turned in registers. `slots` must be good up to the next multiple of kLanes.
void gather_voxels(const VoxelScratch* voxels, const std::uint32_t* slots, int count,
                   const LaneTerms& samples, MatchBlock& block);

}  // namespace roxel

#pragma once
/// From voxels as they lie in memory to the arrays that matching works on.

#include "roxel/infer/evidence.h"
#include "roxel/infer/match.h"

namespace roxel {

/// Fills what the block takes from voxels for the first `count` entries: each voxel's cache line is read once
/// and turned in registers. `diff` gets the voxel's mean and `cov` its covariance: the samples are still to
/// be brought in. `slots` must be good up to the next multiple of kLanes.
void gather_voxels(const VoxelScratch* voxels, const std::uint32_t* slots, int count, MatchBlock& block);

/// Brings one sample in for all of the first `count` entries.
void bring_in_sample(const SampleTerms& sample, int count, MatchBlock& block);

}  // namespace roxel

#include "roxel/infer/gather.h"

#include <cstddef>

#include "roxel/base/kernel.h"

namespace roxel {

namespace {

ROXEL_KERNEL void gather_lines(const VoxelScratch* voxels, const std::uint32_t* slots, int count,
                               const LaneTerms& samples, MatchBlock& block) {
  static_assert(offsetof(VoxelScratch, cov) == 3 * sizeof(float) &&
                offsetof(VoxelScratch, evidence) == 9 * sizeof(float) &&
                offsetof(VoxelScratch, tau) == 10 * sizeof(float));
  Floats mean[3];
#pragma GCC unroll 3
  for (int c = 0; c < 3; ++c) load(samples.mean[c], mean[c]);
  for (int first = 0; first < count; first += kLanes) {
    Floats low[kLanes];
#pragma GCC unroll 8
    for (int i = 0; i < kLanes; ++i) load(voxels[slots[first + i]].mean, low[i]);
    transpose(low);
#pragma GCC unroll 3
    for (int c = 0; c < 3; ++c) store(low[c] - mean[c], block.diff[c] + first);
#pragma GCC unroll 5
    for (int c = 0; c < 5; ++c) store(low[3 + c], block.cov[c] + first);
    FourFloats high[kLanes];
#pragma GCC unroll 8
    for (int i = 0; i < kLanes; ++i) load(voxels[slots[first + i]].mean + kLanes, high[i]);
    Floats columns[4];
    transpose(high, columns);
    store(columns[0], block.cov[5] + first);
    store(columns[1], block.evidence + first);
    store(columns[2], block.tau + first);
  }
}

}  // namespace

void gather_voxels(const VoxelScratch* voxels, const std::uint32_t* slots, int count,
                   const LaneTerms& samples, MatchBlock& block) {
  gather_lines(voxels, slots, count, samples, block);
}

}  // namespace roxel

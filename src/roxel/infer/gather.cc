#include "roxel/infer/gather.h"

#include <algorithm>
#include <cstddef>

#include "roxel/base/kernel.h"

namespace roxel {

namespace {

ROXEL_KERNEL void gather_lines(const VoxelScratch* voxels, const std::uint32_t* slots, int count,
                               MatchBlock& block) {
  static_assert(offsetof(VoxelScratch, cov) == 3 * sizeof(float) &&
                offsetof(VoxelScratch, evidence) == 9 * sizeof(float) &&
                offsetof(VoxelScratch, tau) == 10 * sizeof(float));
  for (int first = 0; first < count; first += kLanes) {
    Floats low[kLanes];
#pragma GCC unroll 8
    for (int i = 0; i < kLanes; ++i) load(voxels[slots[first + i]].mean, low[i]);
    transpose(low);
#pragma GCC unroll 3
    for (int c = 0; c < 3; ++c) store(low[c], block.diff[c] + first);
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

void gather_voxels(const VoxelScratch* voxels, const std::uint32_t* slots, int count, MatchBlock& block) {
  gather_lines(voxels, slots, count, block);
}

void bring_in_sample(const SampleTerms& sample, int count, MatchBlock& block) {
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < count; ++i) block.diff[c][i] -= sample.mean[c];
  for (int c = 0; c < 6; ++c)
    for (int i = 0; i < count; ++i) block.cov[c][i] += sample.cov_plus_noise[c];
  std::fill(block.foreground, block.foreground + count, sample.foreground);
}

}  // namespace roxel

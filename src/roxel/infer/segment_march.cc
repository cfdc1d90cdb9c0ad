#include "roxel/infer/segment_march.h"

#include <cmath>
#include <cstring>

#include "roxel/base/kernel.h"

namespace roxel {

namespace {

/// Eight floats in a register where the machine has such, two halves where not.
using Eight = float __attribute__((vector_size(32)));
constexpr int kLanes = 8;

inline __attribute__((always_inline)) void load(const float* from, Eight& to) {
  std::memcpy(&to, from, sizeof(Eight));
}

/// rows[i][j] <-> rows[j][i].
inline __attribute__((always_inline)) void transpose(Eight rows[kLanes]) {
  Eight a[kLanes], b[kLanes];
  for (int i = 0; i < kLanes; i += 2) {
    a[i] = __builtin_shufflevector(rows[i], rows[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    a[i + 1] = __builtin_shufflevector(rows[i], rows[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
  for (int i = 0; i < kLanes; i += 4)
    for (int j = 0; j < 2; ++j) {
      b[i + 2 * j] = __builtin_shufflevector(a[i + j], a[i + 2 + j], 0, 1, 8, 9, 4, 5, 12, 13);
      b[i + 2 * j + 1] = __builtin_shufflevector(a[i + j], a[i + 2 + j], 2, 3, 10, 11, 6, 7, 14, 15);
    }
  for (int i = 0; i < kLanes / 2; ++i) {
    rows[i] = __builtin_shufflevector(b[i], b[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    rows[i + 4] = __builtin_shufflevector(b[i], b[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

/// Fills what the block takes from voxels for the first `count` entries: each voxel's cache line is read once
/// and turned in registers. `slots` must be good up to the next eighth.
ROXEL_KERNEL void gather_voxels(const VoxelScratch* voxels, const std::uint32_t* slots, int count,
                                const float sample_mean[3], MatchBlock& block) {
  static_assert(offsetof(VoxelScratch, cov) == 3 * sizeof(float) &&
                offsetof(VoxelScratch, evidence) == 9 * sizeof(float) &&
                offsetof(VoxelScratch, tau) == 10 * sizeof(float));
  for (int first = 0; first < count; first += kLanes) {
    Eight low[kLanes], high[kLanes];
    for (int i = 0; i < kLanes; ++i) {
      const float* voxel = voxels[slots[first + i]].mean;
      load(voxel, low[i]);
      load(voxel + kLanes, high[i]);
    }
    transpose(low);
    transpose(high);
    const auto store = [first](float* to, const Eight& from) __attribute__((always_inline)) {
      std::memcpy(to + first, &from, sizeof(Eight));
    };
    for (int c = 0; c < 3; ++c) store(block.diff[c], low[c] - sample_mean[c]);
    for (int c = 0; c < 5; ++c) store(block.cov[c], low[3 + c]);
    store(block.cov[5], high[0]);
    store(block.evidence, high[1]);
    store(block.tau, high[2]);
  }
}

}  // namespace

void RemovedColor::remove(float a, const float color_mean[3], const float color_cov[6], float limit) {
  if (a >= limit) return;
  const float share = a * transmittance;
  for (int c = 0; c < 3; ++c) mean[c] += share * color_mean[c];
  for (int c = 0; c < 6; ++c) cov[c] += share * share * color_cov[c];
  transmittance *= 1 - a;
}

RegionStats RemovedColor::apply(const RegionStats& sample) const {
  RegionStats rest = sample;
  const float inverse = 1 / transmittance;
  for (int c = 0; c < 3; ++c) rest.mean[c] = (sample.mean[c] - mean[c]) * inverse;
  for (int c = 0; c < 6; ++c) rest.cov[c] = (sample.cov[c] + cov[c]) * inverse * inverse;
  return rest;
}

RegionStats SegmentMarch::background_removed(const SampleView& view, const Ray& ray,
                                             const RegionStats& sample) {
  float transmittance = 1;
  stack_.walk(
      ray, view.plan.range, [&](std::uint32_t brick) { scratch_.enter(brick); },
      [&](const VoxelStep& step, const VoxelPlace&) {
        transmittance *= 1 - one_minus_exp(scratch_[step.slot].tau * step.length);
        return true;
      });
  RemovedColor removed;
  removed.remove(transmittance, background_.mean, background_.cov, filters_.limit);
  return removed.apply(sample);
}

Segment SegmentMarch::march(const SampleView& view, const Region& region, const RegionStats& sample_seen,
                            const Ray& ray, Stretch range, const Stretch* sight, RemovedColor& removed,
                            EvaluatedSteps& steps) {
  RegionStats sample = sample_seen;
  if (filters_.background && background_.kind == BackgroundKind::kKnown)
    sample = background_removed(view, ray, sample);
  Segment total;
  in_brick_ = {};
  bool running = true;
  stack_.walk_chunks(
      ray, range, sight, chunk_, [&](std::uint32_t brick) { scratch_.enter(brick); },
      [&](const StepChunk& chunk) {
        running = flush(view, region, sample, chunk, removed, total, steps);
        return running;
      },
      filters_.rays ? 1 : MatchBlock::kSize);
  return total.then(in_brick_);
}

void SegmentMarch::gather(const SampleView& view, const Region& region, const SampleTerms& terms,
                          const StepChunk& chunk) {
  gather_voxels(scratch_.voxels(), chunk.slot, chunk.count, terms.mean, block_);
  std::copy(chunk.length, chunk.length + StepChunk::kSize, block_.length);
  if (!filters_.interpolate) return;
  const LatticeFrame& frame = stack_.volume().index(chunk.lattice).frame();
  for (int i = 0; i < chunk.count; ++i) {
    const Eigen::Vector3d at = view.camera.project(frame.voxel_centre(chunk.voxel(i)));
    float mean[3];
    if (!view.pyramid->bilinear(region.level, at.x(), at.y(), mean)) continue;
    for (int c = 0; c < 3; ++c) block_.diff[c][i] += terms.mean[c] - mean[c];
  }
}

/// Folds the chunk's steps in ray order, brick by brick, and stops where a fresh brick could no longer change
/// the likelihood. Returns how many steps were taken.
int SegmentMarch::fold(const StepChunk& chunk, RemovedColor& removed, Segment& total) {
  int i = 0;
  for (int brick = 0;; ++brick) {
    const int end = brick < chunk.brick_count ? chunk.brick_begin[brick] : chunk.count;
    Segment in_brick = in_brick_;
    for (int k = i; k < end; ++k) in_brick.append(block_.opacity[k], block_.likelihood[k]);
    for (; i < end && filters_.rays; ++i) {
      const VoxelScratch& voxel = scratch_[chunk.slot[i]];
      removed.remove(block_.opacity[i], voxel.mean, voxel.cov, filters_.limit);
    }
    i = end;
    in_brick_ = in_brick;
    if (brick == chunk.brick_count) return i;
    total = total.then(in_brick_);
    in_brick_ = {};
    if (early_stop_ && total.transmittance < kNegligible * total.likelihood) return i;
  }
}

bool SegmentMarch::flush(const SampleView& view, const Region& region, const RegionStats& sample,
                         const StepChunk& chunk, RemovedColor& removed, Segment& total,
                         EvaluatedSteps& steps) {
  for (int i = 0; i < chunk.count; ++i) __builtin_prefetch(&scratch_[chunk.slot[i]]);
  const SampleTerms terms = sample_terms(filters_.rays ? removed.apply(sample) : sample, model_);
  gather(view, region, terms, chunk);
  evaluate_match(model_, terms, chunk.count, block_);
  const int taken = fold(chunk, removed, total);
  steps.append(chunk, block_, taken, depths_);
  return taken == chunk.count;
}

void EvaluatedSteps::append(const StepChunk& chunk, const MatchBlock& block, int count, bool with_depths) {
  if (slot_.size() < size_ + StepChunk::kSize) {
    const std::size_t room = 2 * (size_ + StepChunk::kSize);
    slot_.resize(room);
    for (std::vector<float>& field : field_) field.resize(room);
  }
  if (with_depths && depth_.size() < slot_.size()) depth_.resize(slot_.size());
  std::copy_n(chunk.slot, count, slot_.data() + size_);
  std::copy_n(chunk.length, count, field_[kLength].data() + size_);
  std::copy_n(chunk.weight, count, field_[kWeight].data() + size_);
  std::copy_n(block.opacity, count, field_[kOpacity].data() + size_);
  std::copy_n(block.likelihood, count, field_[kLikelihood].data() + size_);
  std::copy_n(block.mean_path, count, field_[kMeanPath].data() + size_);
  for (int i = 0; with_depths && i < count; ++i)
    depth_[size_ + i] = {chunk.depth(i), 0.5f * chunk.length[i] * chunk.depth_per_length};
  size_ += count;
}

}  // namespace roxel

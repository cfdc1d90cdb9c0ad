#include "roxel/infer/segment_march.h"

#include "roxel/infer/gather.h"

namespace roxel {

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

RegionStats without_background(const LatticeStack& stack, const SampleView& view, const Ray& ray,
                               const RegionStats& sample, const Background& background,
                               const SampleFilters& filters, NodeScratch& scratch) {
  float transmittance = 1;
  stack.walk(
      ray, view.plan.range, [&](std::uint32_t brick) { scratch.enter(brick); },
      [&](const VoxelStep& step, const VoxelPlace&) {
        transmittance *= 1 - one_minus_exp(scratch[step.slot].tau * step.length);
        return true;
      });
  RemovedColor removed;
  removed.remove(transmittance, background.mean, background.cov, filters.limit);
  return removed.apply(sample);
}

bool mean_at_voxel(const SampleView& view, const Region& region, const LatticeFrame& frame,
                   const Eigen::Vector3i& voxel, float mean[3]) {
  const Eigen::Vector3d at = view.camera.project(frame.voxel_centre(voxel));
  float there[3];
  if (!view.pyramid->bilinear(region.level, at.x(), at.y(), there)) return false;
  std::copy(there, there + 3, mean);
  return true;
}

Segment SegmentMarch::march(const SampleView& view, const Region& region, const RegionStats& sample_seen,
                            const Ray& ray, Stretch range, const Stretch* sight, RemovedColor& removed,
                            EvaluatedSteps& steps) {
  RegionStats sample = sample_seen;
  if (filters_.background && background_.kind == BackgroundKind::kKnown)
    sample = without_background(stack_, view, ray, sample, background_, filters_, scratch_);
  Segment total;
  in_brick_ = {};
  bool running = true;
  stack_.walk_chunks(
      ray, range, sight, chunk_, [&](std::uint32_t brick) { scratch_.enter(brick); },
      [&](const StepChunk& chunk) {
        running = flush(view, region, sample, chunk, removed, total, steps);
        return running;
      },
      filters_.rays ? 1 : StepChunk::kSize);
  return total.then(in_brick_);
}

void SegmentMarch::gather(const SampleView& view, const Region& region, const SampleTerms& terms,
                          const StepChunk& chunk) {
  gather_voxels(scratch_.voxels(), chunk.slot, chunk.count, block_);
  bring_in_sample(terms, chunk.count, block_);
  std::copy(chunk.length, chunk.length + StepChunk::kSize, block_.length);
  if (!filters_.interpolate) return;
  const LatticeFrame& frame = stack_.volume().index(chunk.lattice).frame();
  for (int i = 0; i < chunk.count; ++i) {
    float mean[3];
    if (!mean_at_voxel(view, region, frame, chunk.voxel(i), mean)) continue;
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
  evaluate_match(model_, chunk.count, block_);
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

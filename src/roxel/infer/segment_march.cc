#include "roxel/infer/segment_march.h"

#include <cmath>

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
                            std::vector<EvaluatedStep>& steps) {
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
  const float mean0 = terms.mean[0], mean1 = terms.mean[1], mean2 = terms.mean[2];
  for (int i = 0; i < chunk.count; ++i) {
    const VoxelScratch& voxel = scratch_[chunk.slot[i]];
    block_.diff[0][i] = voxel.mean[0] - mean0;
    block_.diff[1][i] = voxel.mean[1] - mean1;
    block_.diff[2][i] = voxel.mean[2] - mean2;
    for (int c = 0; c < 6; ++c) block_.cov[c][i] = voxel.cov[c];
    block_.evidence[i] = voxel.evidence;
    block_.tau[i] = voxel.tau;
    block_.length[i] = chunk.length[i];
  }
  if (!filters_.interpolate) return;
  const LatticeFrame& frame = stack_.volume().index(chunk.lattice).frame();
  for (int i = 0; i < chunk.count; ++i) {
    const Eigen::Vector3d at = view.camera.project(frame.voxel_centre(chunk.voxel(i)));
    float mean[3];
    if (!view.pyramid->bilinear(region.level, at.x(), at.y(), mean)) continue;
    for (int c = 0; c < 3; ++c) block_.diff[c][i] += terms.mean[c] - mean[c];
  }
}

bool SegmentMarch::flush(const SampleView& view, const Region& region, const RegionStats& sample,
                         const StepChunk& chunk, RemovedColor& removed, Segment& total,
                         std::vector<EvaluatedStep>& steps) {
  const int count = chunk.count;
  for (int i = 0; i < count; ++i) __builtin_prefetch(&scratch_[chunk.slot[i]]);
  const SampleTerms terms = sample_terms(filters_.rays ? removed.apply(sample) : sample, model_);
  gather(view, region, terms, chunk);
  evaluate_match(model_, terms, count, block_);

  // Fold in ray order, brick by brick; stop where a fresh brick could no longer change the likelihood.
  const std::size_t first = steps.size();
  steps.resize(first + count);
  EvaluatedStep* step = steps.data() + first;
  int kept = 0;
  bool running = true;
  for (; kept < count; ++kept, ++step) {
    const int i = kept;
    if (chunk.brick_start[i]) {
      total = total.then(in_brick_);
      in_brick_ = {};
      if (early_stop_ && total.transmittance < kNegligible * total.likelihood) {
        running = false;
        break;
      }
    }
    const float a = block_.opacity[i], p = block_.likelihood[i];
    in_brick_.append(a, p);
    *step = {chunk.slot[i],
             block_.length[i],
             chunk.weight[i],
             chunk.depth(i),
             0.5f * chunk.length[i] * chunk.depth_per_length,
             a,
             p,
             block_.mean_path[i]};
    if (filters_.rays) {
      const VoxelScratch& voxel = scratch_[chunk.slot[i]];
      removed.remove(a, voxel.mean, voxel.cov, filters_.limit);
    }
  }
  steps.resize(first + kept);
  return running;
}

}  // namespace roxel

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

RegionStats SegmentMarch::background_removed(const SampleView& view, const Ray& ray, const RegionStats& sample) {
  float transmittance = 1;
  stack_.walk(ray, view.plan.range, [&](std::uint32_t brick) { scratch_.enter(brick); },
              [&](const VoxelStep& step, const VoxelPlace&) {
                transmittance *= 1 - one_minus_exp(scratch_[step.slot].tau * step.length);
                return true;
              });
  RemovedColor removed;
  removed.remove(transmittance, background_.mean, background_.cov, filters_.limit);
  return removed.apply(sample);
}

Segment SegmentMarch::march(const SampleView& view, const Region& region, const RegionStats& sample_seen,
                            const Ray& ray, Stretch range, RemovedColor& removed,
                            std::vector<EvaluatedStep>& steps) {
  RegionStats sample = sample_seen;
  if (filters_.background && background_.kind == BackgroundKind::kKnown)
    sample = background_removed(view, ray, sample);
  const int chunk = filters_.rays ? 1 : MatchBlock::kSize;
  Segment total;
  in_brick_ = {};
  pending_count_ = 0;
  bool next_starts_brick = false, running = true;
  const double norm = ray.direction.norm();
  stack_.walk(
      ray, range,
      [&](std::uint32_t brick) {
        scratch_.enter(brick);
        next_starts_brick = true;
      },
      [&](const VoxelStep& step, const VoxelPlace& place) {
        __builtin_prefetch(&scratch_[step.slot]);
        const LatticeFrame& frame = stack_.volume().index(place.lattice).frame();
        half_chord_[pending_count_] = static_cast<float>(0.5 * step.length * frame.voxel_size / norm);
        if (filters_.interpolate) centre_[pending_count_] = place.centre(frame);
        brick_start_[pending_count_] = next_starts_brick;
        next_starts_brick = false;
        pending_[pending_count_++] = step;
        if (pending_count_ == chunk) running = flush(view, region, sample, removed, total, steps);
        return running;
      });
  if (running) flush(view, region, sample, removed, total, steps);
  return total.then(in_brick_);
}

bool SegmentMarch::flush(const SampleView& view, const Region& region, const RegionStats& sample,
                         RemovedColor& removed, Segment& total, std::vector<EvaluatedStep>& steps) {
  const int count = pending_count_;
  pending_count_ = 0;
  if (count == 0) return true;
  const SampleTerms terms = sample_terms(filters_.rays ? removed.apply(sample) : sample, model_);

  // Gather what the scratch knows about the voxels.
  for (int i = 0; i < count; ++i) {
    const VoxelScratch& voxel = scratch_[pending_[i].slot];
    float mean[3] = {terms.mean[0], terms.mean[1], terms.mean[2]};
    if (filters_.interpolate) {
      const Eigen::Vector3d at = view.camera.project(centre_[i]);
      view.pyramid->bilinear(region.level, at.x(), at.y(), mean);
    }
    for (int c = 0; c < 3; ++c) block_.diff[c][i] = voxel.mean[c] - mean[c];
    for (int c = 0; c < 6; ++c) block_.cov[c][i] = voxel.cov[c];
    block_.evidence[i] = voxel.evidence;
    block_.tau[i] = voxel.tau;
    block_.length[i] = pending_[i].length;
  }
  if (model_.first_channel_wraps)
    for (int i = 0; i < count; ++i)
      block_.diff[0][i] -= model_.wrap_period * std::round(block_.diff[0][i] / model_.wrap_period);

  evaluate_match(model_, terms, count, block_);

  // Fold in ray order, brick by brick.
  for (int i = 0; i < count; ++i) {
    if (brick_start_[i]) {
      total = total.then(in_brick_);
      in_brick_ = {};
      if (early_stop_ && total.transmittance < kNegligible * total.likelihood) return false;
    }
    in_brick_.append(block_.opacity[i], block_.likelihood[i]);
    steps.push_back({pending_[i].slot, block_.length[i], pending_[i].weight, pending_[i].depth, half_chord_[i],
                     block_.opacity[i], block_.likelihood[i], block_.mean_path[i]});
    if (filters_.rays) {
      const VoxelScratch& voxel = scratch_[pending_[i].slot];
      removed.remove(block_.opacity[i], voxel.mean, voxel.cov, filters_.limit);
    }
  }
  if (early_stop_) {
    const Segment now = total.then(in_brick_);
    if (now.transmittance < kNegligible * now.likelihood) return false;
  }
  return true;
}

}  // namespace roxel

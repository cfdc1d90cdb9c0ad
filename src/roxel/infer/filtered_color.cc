#include "roxel/infer/filtered_color.h"

#include "roxel/infer/color_packets.h"

namespace roxel {

namespace {

/// Adds a sample to a voxel's colour sums.
void add_sample(const RegionStats& sample, float w, VoxelScratch& voxel) {
  const float* m = sample.mean;
  const float second[6] = {m[0] * m[0], m[1] * m[1], m[2] * m[2], m[0] * m[1], m[0] * m[2], m[1] * m[2]};
  for (int c = 0; c < 3; ++c) voxel.mean[c] += w * m[c];
  for (int c = 0; c < 6; ++c) voxel.cov[c] += w * (sample.cov[c] + second[c]);
  voxel.evidence += w;
}

}  // namespace

void FilteredColorMarch::deposit(const SampleView& view, const Region& region, const RegionStats& sample,
                                 float weight, const StepChunk& chunk, float& transmittance,
                                 RemovedColor& removed) {
  const Volume& volume = stack_.volume();
  for (int i = 0; i < chunk.count && goes_on(transmittance); ++i) {
    const std::uint32_t slot = chunk.slot[i];
    VoxelScratch& voxel = scratch_[slot];
    RegionStats seen = sample;
    if (options_.filters.interpolate)
      mean_at_voxel(view, region, volume.index(chunk.lattice).frame(), chunk.voxel(i), seen.mean);
    if (options_.filters.rays) seen = removed.apply(seen);
    const float a = one_minus_exp(voxel.tau * chunk.length[i]);
    const float share = (everywhere_ ? 1 : a * transmittance) * chunk.weight[i] * weight;
    if (share >= kLeastColorWeight) add_sample(seen, share, voxel);
    if (options_.filters.rays && !everywhere_ && volume.color_weight[slot] > 0)
      removed.remove(a, volume.color_mean[slot].data(), volume.color_cov[slot].unpacked().data(),
                     options_.filters.limit);
    transmittance *= 1 - a;
    ++counts.steps;
  }
}

bool FilteredColorMarch::goes_on(float transmittance) const {
  return everywhere_ || transmittance >= spent_transmittance(options_.rule);
}

void FilteredColorMarch::march(const ViewInSight& in_sight, const Region& region, double begin,
                               float transmittance, RemovedColor removed) {
  const SampleView& view = in_sight.view;
  RegionStats sample = view.pyramid->at(region.level, region.x, region.y);
  if (sample.valid <= 0 || sample.foreground <= 0) return;
  const Stretch range = served_range(view, region, begin);
  const Eigen::Vector2d at = region_centre(view, region);
  const Stretch* sight = range.end > range.begin ? in_sight.sight.within(at.x(), at.y(), range) : nullptr;
  if (sight) {
    ++counts.rays;
    const Ray ray = view.camera.ray(at.x(), at.y());
    const float weight = color_weight(view, region, sample, options_);
    if (options_.filters.background && options_.background.kind == BackgroundKind::kKnown)
      sample = without_background(stack_, view, ray, sample, options_.background, options_.filters, scratch_);
    stack_.walk_chunks(
        ray, range, sight, chunk_, [&](std::uint32_t brick) { scratch_.enter(brick); },
        [&](const StepChunk& chunk) {
          deposit(view, region, sample, weight, chunk, transmittance, removed);
          return goes_on(transmittance);
        });
  }
  if (range.end >= view.plan.range.end || region.level == view.plan.finest_level || !goes_on(transmittance))
    return;
  for (int c = 0; c < 4; ++c)
    if (const Region child = region.child(c); inside(view, child))
      march(in_sight, child, std::max(range.begin, range.end), transmittance, removed);
}

}  // namespace roxel

#include "roxel/infer/color_packets.h"

#include <cstddef>

#include "roxel/base/fast_exp.h"
#include "roxel/base/kernel.h"
#include "roxel/base/lanes.h"
#include "roxel/infer/packet_sums.h"

namespace roxel {

namespace {

/// Opacities of the steps.
ROXEL_KERNEL void opacities_of(const PacketSteps& steps, const VoxelScratch* voxels, float* opacity) {
  for (int i = 0; i < steps.count; ++i) opacity[i] = voxels[steps.slot[i]].tau;
  const int padded = (steps.count + kLanes - 1) / kLanes * kLanes;  // what lies behind is left unread
  for (int i = 0; i < padded; ++i) opacity[i] = one_minus_exp(opacity[i] * steps.length[i]);
}

/// Gives each step's sample to its voxel.
ROXEL_KERNEL void deposit_samples(const PacketSteps& steps, const float* share, const ColorLanes& lanes,
                                  VoxelScratch* voxels) {
  static_assert(offsetof(VoxelScratch, cov) == 3 * sizeof(float) &&
                offsetof(VoxelScratch, evidence) == 9 * sizeof(float));
  for (int i = 0; i < steps.count; ++i) {
    const float w = share[i];
    if (w < kLeastColorWeight) continue;
    float* const voxel = voxels[steps.slot[i]].mean;
    const int ray = steps.ray[i];
    Floats low, mine_low;
    FourFloats high, mine_high;
    load(voxel, low);
    load(voxel + kLanes, high);
    load(lanes.low[ray], mine_low);
    load(lanes.high[ray], mine_high);
    store(low + w * mine_low, voxel);
    store(high + w * mine_high, voxel + kLanes);
  }
}

}  // namespace

void ColorLanes::set(int ray, const RegionStats& sample, float whole, float reaches) {
  const float* m = sample.mean;
  for (int c = 0; c < 3; ++c) low[ray][c] = m[c];
  for (int c = 0; c < 3; ++c) low[ray][3 + c] = sample.cov[c] + m[c] * m[c];
  low[ray][6] = sample.cov[3] + m[0] * m[1];
  low[ray][7] = sample.cov[4] + m[0] * m[2];
  high[ray][0] = sample.cov[5] + m[1] * m[2];
  high[ray][1] = 1;
  weight[ray] = whole;
  transmittance[ray] = reaches;
}

float color_weight(const SampleView& view, const Region& region, const RegionStats& sample,
                   const MarchOptions& options) {
  const Background& background = options.background;
  const float known = background.kind == BackgroundKind::kKnown
                          ? known_background_share(background, options.model, sample)
                          : 0.0f;
  return observation_weight(view, region, sample) * sample.foreground * (1 - known);
}

void ColorPackets::tile(const ListedView& listed, const Tile& tile) {
  if (listed.lists.none_from(listed.view.plan.root_level, tile.x0, tile.y0)) return;
  samples_.clear();
  march_tile(*this, listed, tile);
}

/// Adds the region's sample, unless it shows nothing of the object.
void ColorPackets::add(const SampleView& view, const Region& region, int parent) {
  if (view.pyramid->valid(region.level, region.x, region.y) <= 0) return;
  if (view.pyramid->at(region.level, region.x, region.y).foreground <= 0) return;
  samples_.push_back({region, parent < 0 ? 1.0f : samples_[parent].transmittance});
}

void ColorPackets::march(const SampleView& view, const SamplePacket& packet) {
  ColorLanes lanes;
  for (int ray = 0; ray < packet.count; ++ray) {
    const Sample& sample = samples_[packet.sample[ray]];
    const RegionStats stats = view.pyramid->at(sample.region.level, sample.region.x, sample.region.y);
    lanes.set(ray, stats, color_weight(view, sample.region, stats, options_), sample.transmittance);
  }
  counts.rays += packet.count;
  while (walk_.next(steps_)) {
    if (steps_.count == 0) continue;
    deposit(lanes);
    for (int ray = 0; ray < packet.count; ++ray)
      if (!goes_on(lanes.transmittance[ray])) walk_.stop(ray);
  }
  for (int ray = 0; ray < packet.count; ++ray)
    samples_[packet.sample[ray]].transmittance = lanes.transmittance[ray];
}

/// Gives the samples to the voxels of the steps that the walk has found.
void ColorPackets::deposit(ColorLanes& lanes) {
  alignas(64) float opacity[PacketSteps::kPadded], share[PacketSteps::kPadded];
  for (int b = 0; b < steps_.brick_count; ++b) scratch_.enter(steps_.bricks[b]);
  for (int i = 0; i < steps_.count; ++i) __builtin_prefetch(&scratch_[steps_.slot[i]], 1);
  if (!everywhere_) opacities_of(steps_, scratch_.voxels(), opacity);
  color_shares(steps_, everywhere_ ? nullptr : opacity, lanes.weight, lanes.transmittance, share);
  deposit_samples(steps_, share, lanes, scratch_.voxels());
  counts.steps += steps_.count;
}

bool ColorPackets::divides(const SampleView&, std::size_t sample, bool last) const {
  return !last && goes_on(samples_[sample].transmittance);
}

}  // namespace roxel

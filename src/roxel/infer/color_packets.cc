#include "roxel/infer/color_packets.h"

#include <cstddef>

#include "roxel/base/fast_exp.h"
#include "roxel/base/kernel.h"

namespace roxel {

namespace {

constexpr float kLeastWeight = 1e-6f;  ///< weights that cannot matter against evidence_half

/// Gives each lane's sample to the voxels of its steps.
ROXEL_KERNEL void deposit_rows(const StepRows& steps, bool everywhere, ColorLanes& lanes,
                               VoxelScratch* voxels) {
  static_assert(offsetof(VoxelScratch, cov) == 3 * sizeof(float) &&
                offsetof(VoxelScratch, evidence) == 9 * sizeof(float));
  alignas(64) float share[StepRows::kMaxRows][kLanes];
  Floats weight;
  load(lanes.weight, weight);
  if (everywhere) {
    for (int row = 0; row < steps.rows; ++row) {
      Floats ray_weight;
      load(steps.weight[row], ray_weight);
      store(ray_weight * weight, share[row]);
    }
  } else {
    for (int row = 0; row < steps.rows; ++row)
#pragma GCC unroll 8
      for (int lane = 0; lane < kLanes; ++lane) share[row][lane] = voxels[steps.slot[row][lane]].tau;
    float* const opacity = &share[0][0];
    const float* const length = &steps.length[0][0];
    for (int i = 0; i < steps.rows * kLanes; ++i) opacity[i] = one_minus_exp(opacity[i] * length[i]);
    Floats transmittance;
    load(lanes.transmittance, transmittance);
    for (int row = 0; row < steps.rows; ++row) {
      Floats a, ray_weight;
      load(share[row], a);
      load(steps.weight[row], ray_weight);
      store(a * transmittance * ray_weight * weight, share[row]);
      transmittance *= 1.0f - a;
    }
    store(transmittance, lanes.transmittance);
  }
  for (int row = 0; row < steps.rows; ++row)
#pragma GCC unroll 8
    for (int lane = 0; lane < kLanes; ++lane) {
      const float w = share[row][lane];
      if (w < kLeastWeight) continue;
      float* const voxel = voxels[steps.slot[row][lane]].mean;
      Floats low, mine_low;
      FourFloats high, mine_high;
      load(voxel, low);
      load(voxel + kLanes, high);
      load(lanes.low[lane], mine_low);
      load(lanes.high[lane], mine_high);
      store(low + w * mine_low, voxel);
      store(high + w * mine_high, voxel + kLanes);
    }
}

}  // namespace

void ColorLanes::set(int lane, const RegionStats& sample, float whole, float reaches) {
  const float* m = sample.mean;
  for (int c = 0; c < 3; ++c) low[lane][c] = m[c];
  for (int c = 0; c < 3; ++c) low[lane][3 + c] = sample.cov[c] + m[c] * m[c];
  low[lane][6] = sample.cov[3] + m[0] * m[1];
  low[lane][7] = sample.cov[4] + m[0] * m[2];
  high[lane][0] = sample.cov[5] + m[1] * m[2];
  high[lane][1] = 1;
  weight[lane] = whole;
  transmittance[lane] = reaches;
}

void ColorPackets::tile(const ViewInSight& in_sight, const Tile& tile) {
  samples_.clear();
  march_tile(*this, in_sight, tile);
}

/// Adds the region's sample, unless it shows nothing of the object.
void ColorPackets::add(const SampleView& view, const Region& region, int parent) {
  if (view.pyramid->valid(region.level, region.x, region.y) <= 0) return;
  if (view.pyramid->at(region.level, region.x, region.y).foreground <= 0) return;
  samples_.push_back({region, parent < 0 ? 1.0f : samples_[parent].transmittance});
}

float ColorPackets::sample_weight(const SampleView& view, const Region& region,
                                  const RegionStats& sample) const {
  const Background& background = options_.background;
  const float known = background.kind == BackgroundKind::kKnown
                          ? known_background_share(background, options_.model, sample)
                          : 0.0f;
  return observation_weight(view, region, sample) * sample.foreground * (1 - known);
}

void ColorPackets::march(const SampleView& view, const SamplePacket& packet) {
  ColorLanes lanes;
  for (int lane = 0; lane < packet.count; ++lane) {
    const Sample& sample = samples_[packet.sample[lane]];
    const RegionStats stats = view.pyramid->at(sample.region.level, sample.region.x, sample.region.y);
    lanes.set(lane, stats, sample_weight(view, sample.region, stats), sample.transmittance);
  }
  counts.rays += packet.count;
  while (walk_.next(steps_)) {
    for (int b = 0; b < steps_.brick_count; ++b) scratch_.enter(steps_.bricks[b]);
    for (int row = 0; row < steps_.rows; ++row)
      for (const std::uint32_t slot : steps_.slot[row]) __builtin_prefetch(&scratch_[slot], 1);
    deposit_rows(steps_, everywhere_, lanes, scratch_.voxels());
    for (int lane = 0; lane < packet.count; ++lane) {
      counts.steps += steps_.count[lane];
      if (!goes_on(lanes.transmittance[lane])) walk_.stop(lane);
    }
  }
  for (int lane = 0; lane < packet.count; ++lane)
    samples_[packet.sample[lane]].transmittance = lanes.transmittance[lane];
}

bool ColorPackets::divides(const SampleView&, std::size_t sample, bool last) const {
  return !last && goes_on(samples_[sample].transmittance);
}

}  // namespace roxel

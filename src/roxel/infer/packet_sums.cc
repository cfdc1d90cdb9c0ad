#include "roxel/infer/packet_sums.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "roxel/base/lanes.h"
#include "roxel/base/vector_targets.h"
#include "roxel/infer/lane_ranks.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "roxel/infer/packet_sums.cc"
#include <hwy/foreach_target.h>  // before highway.h

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace roxel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using FloatTag = hn::CappedTag<float, kMaxPacketRays>;
using IntTag = hn::RebindToSigned<FloatTag>;
using FloatVector = hn::Vec<FloatTag>;
using FloatMask = hn::Mask<FloatTag>;

constexpr int kRays = static_cast<int>(hn::MaxLanes(FloatTag()));

HWY_INLINE FloatMask mask_of(std::uint32_t rays) {
  const std::uint8_t bits[8] = {static_cast<std::uint8_t>(rays), static_cast<std::uint8_t>(rays >> 8)};
  return hn::LoadMaskBits(FloatTag(), bits);
}

/// Gives the numbers at `from` to the rays of the mask, in order, and 0 to the others.
HWY_INLINE FloatVector expand(const float* from, std::uint32_t rays, FloatMask mask) {
  const FloatTag d;
  const auto values = hn::LoadU(d, from);
#if HWY_TARGET <= HWY_AVX3  // and what came after it
  static_cast<void>(mask);
  return FloatVector{_mm512_maskz_expand_ps(static_cast<__mmask16>(rays), values.raw)};
#else
  const hn::Rebind<std::uint8_t, FloatTag> bytes;
  static_assert(kRays <= 8);
  const auto ranks = hn::PromoteTo(IntTag(), hn::LoadU(bytes, kLaneRanks[rays].data()));
  return hn::IfThenElseZero(mask, hn::TableLookupLanes(values, hn::IndicesFromVec(d, ranks)));
#endif
}

void bring_in(const PacketTerms& samples, const PacketSteps& steps, MatchBlock& block) {
  const FloatTag d;
  const IntTag di;
  FloatVector mean[3], cov[6];
  for (int c = 0; c < 3; ++c) mean[c] = hn::Load(d, samples.mean[c]);
  for (int c = 0; c < 6; ++c) cov[c] = hn::Load(d, samples.cov_plus_noise[c]);
  const auto foreground = hn::Load(d, samples.foreground);
  for (int i = 0; i < steps.count; i += kRays) {
    const auto ray = hn::IndicesFromVec(d, hn::LoadU(di, steps.ray + i));
    for (int c = 0; c < 3; ++c) {
      float* const at = block.diff[c] + i;
      hn::StoreU(hn::Sub(hn::LoadU(d, at), hn::TableLookupLanes(mean[c], ray)), d, at);
    }
    for (int c = 0; c < 6; ++c) {
      float* const at = block.cov[c] + i;
      hn::StoreU(hn::Add(hn::LoadU(d, at), hn::TableLookupLanes(cov[c], ray)), d, at);
    }
    hn::StoreU(hn::TableLookupLanes(foreground, ray), d, block.foreground + i);
  }
}

void fold(const PacketSteps& steps, const MatchBlock& block, PacketSegments& segments, float* share,
          float* before) {
  const FloatTag d;
  const auto one = hn::Set(d, 1.0f);
  const auto total_t = hn::Load(d, segments.transmittance), total_l = hn::Load(d, segments.likelihood);
  auto t = one, l = hn::Zero(d);
  int i = 0;
  for (int row = 0; row < steps.rows; ++row) {
    const std::uint32_t rays = steps.rays[row];
    const FloatMask mask = mask_of(rays);
    const auto a = expand(block.opacity + i, rays, mask);
    const auto p = expand(block.likelihood + i, rays, mask);
    const auto w = hn::Mul(hn::Mul(t, a), p);
    hn::StoreU(hn::Compress(hn::Mul(total_t, w), mask), d, share + i);
    hn::StoreU(hn::Compress(hn::MulAdd(total_t, l, total_l), mask), d, before + i);
    l = hn::Add(l, w);
    t = hn::Mul(t, hn::Sub(one, a));
    i += __builtin_popcount(rays);
  }
  // As Segment::then, to the same bits: each product is rounded before it is added.
  hn::Store(hn::Add(total_l, hn::Mul(total_t, l)), d, segments.likelihood);
  hn::Store(hn::Mul(total_t, t), d, segments.transmittance);
}

void weigh_colors(const PacketSteps& steps, const float* opacity, const float* weight, float* transmittance,
                  float* share) {
  const FloatTag d;
  const IntTag di;
  const auto whole = hn::Load(d, weight);
  if (!opacity) {
    for (int i = 0; i < steps.count; i += kRays) {
      const auto ray = hn::IndicesFromVec(d, hn::LoadU(di, steps.ray + i));
      hn::StoreU(hn::Mul(hn::LoadU(d, steps.weight + i), hn::TableLookupLanes(whole, ray)), d, share + i);
    }
    return;
  }
  const auto one = hn::Set(d, 1.0f);
  auto t = hn::Load(d, transmittance);
  int i = 0;
  for (int row = 0; row < steps.rows; ++row) {
    const std::uint32_t rays = steps.rays[row];
    const FloatMask mask = mask_of(rays);
    const auto a = expand(opacity + i, rays, mask);
    const auto of_row = hn::Compress(hn::Mul(hn::Mul(a, t), whole), mask);
    hn::StoreU(hn::Mul(of_row, hn::LoadU(d, steps.weight + i)), d, share + i);
    t = hn::Mul(t, hn::Sub(one, a));
    i += __builtin_popcount(rays);
  }
  hn::Store(t, d, transmittance);
}

/// Adds each step's sums to its voxel's.
HWY_INLINE void add_to_voxels(const float sums[3][kMaxPacketRays], const std::uint32_t* slot, int count,
                              VoxelScratch* voxels) {
  static_assert(offsetof(VoxelScratch, exposure) == offsetof(VoxelScratch, hits) + sizeof(float) &&
                offsetof(VoxelScratch, looked) == offsetof(VoxelScratch, hits) + 2 * sizeof(float));
  for (int i = 0; i < count; ++i) {
    const FourFloats mine = {sums[0][i], sums[1][i], sums[2][i], 0};
    float* const voxel = &voxels[slot[i]].hits;
    FourFloats old;
    load(voxel, old);
    const FourFloats sum = old + mine, most = old > mine ? old : mine;
    store(__builtin_shufflevector(sum, most, 0, 1, 6, 3), voxel);
  }
}

void give_out(PacketRecord& record, std::size_t begin, std::size_t end, bool ray_weights,
              const PacketReach& rays, VoxelScratch* voxels) {
  const FloatTag d;
  const IntTag di;
  const auto zero = hn::Zero(d);
  const auto all_reach = hn::Load(d, rays.reach), all_scale = hn::Load(d, rays.scale),
             all_weight = hn::Load(d, rays.weight);
  alignas(64) float sums[3][kMaxPacketRays];
  for (std::size_t i = begin; i < end; i += kRays) {
    const auto ray = hn::IndicesFromVec(d, hn::LoadU(di, record.ray() + i));
    const auto scale = hn::TableLookupLanes(all_scale, ray);
    const auto share = hn::LoadU(d, record.share() + i), before = hn::LoadU(d, record.before() + i);
    const auto weight = hn::LoadU(d, record.weight() + i);
    const auto reach = hn::Max(hn::NegMulAdd(scale, before, hn::TableLookupLanes(all_reach, ray)), zero);
    const auto r = hn::Min(hn::Mul(scale, share), reach);
    auto w = hn::TableLookupLanes(all_weight, ray);
    if (ray_weights) w = hn::Mul(w, weight);
    const auto path = hn::MulAdd(hn::Sub(reach, r), hn::LoadU(d, record.length() + i),
                                 hn::Mul(r, hn::LoadU(d, record.mean_path() + i)));
    hn::Store(hn::Mul(w, r), d, sums[0]);
    hn::Store(hn::Mul(w, path), d, sums[1]);
    hn::Store(hn::Mul(reach, weight), d, sums[2]);
    add_to_voxels(sums, record.slot() + i, static_cast<int>(std::min<std::size_t>(kRays, end - i)), voxels);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace roxel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace roxel {

HWY_EXPORT(bring_in);
HWY_EXPORT(fold);
HWY_EXPORT(weigh_colors);
HWY_EXPORT(give_out);

void PacketTerms::set(int ray, const SampleTerms& sample) {
  for (int c = 0; c < 3; ++c) mean[c][ray] = sample.mean[c];
  for (int c = 0; c < 6; ++c) cov_plus_noise[c][ray] = sample.cov_plus_noise[c];
  foreground[ray] = sample.foreground;
}

PacketSegments::PacketSegments() {
  std::fill(transmittance, transmittance + kMaxPacketRays, 1.0f);
  std::fill(likelihood, likelihood + kMaxPacketRays, 0.0f);
}

std::size_t PacketRecord::append(std::size_t count) {
  const std::size_t needed = size_ + count + kMaxPacketRays;
  if (needed > capacity_) {
    const std::size_t capacity = 2 * needed;
    const auto grow = [&](auto& array, int columns) {
      std::remove_reference_t<decltype(array)> larger(
          new std::remove_reference_t<decltype(array[0])>[columns * capacity]());
      for (int c = 0; c < columns; ++c)
        std::copy_n(array.get() + c * capacity_, size_, larger.get() + c * capacity);
      array = std::move(larger);
    };
    grow(slots_, 1);
    grow(rays_, 1);
    grow(columns_, kColumns);
    capacity_ = capacity;
  }
  return std::exchange(size_, size_ + count);
}

void bring_in_samples(const PacketTerms& samples, const PacketSteps& steps, MatchBlock& block) {
  HWY_DYNAMIC_DISPATCH(bring_in)(samples, steps, block);
}

void fold_steps(const PacketSteps& steps, const MatchBlock& block, PacketSegments& segments, float* share,
                float* before) {
  HWY_DYNAMIC_DISPATCH(fold)(steps, block, segments, share, before);
}

void color_shares(const PacketSteps& steps, const float* opacity, const float* weight, float* transmittance,
                  float* share) {
  HWY_DYNAMIC_DISPATCH(weigh_colors)(steps, opacity, weight, transmittance, share);
}

void give_out_reach(PacketRecord& record, std::size_t begin, std::size_t end, bool ray_weights,
                    const PacketReach& rays, VoxelScratch* voxels) {
  HWY_DYNAMIC_DISPATCH(give_out)(record, begin, end, ray_weights, rays, voxels);
}

}  // namespace roxel
#endif

#include "roxel/infer/packet_march.h"

#include <cstddef>
#include <cstring>
#include <utility>

#include "roxel/base/kernel.h"
#include "roxel/infer/gather.h"
#include "roxel/infer/segment_march.h"

namespace roxel {

namespace {

constexpr int kBlockRows = MatchBlock::kSize / kLanes;

/// Keeps a product from being fused with the sum that it goes into: Segment::then rounds both, and must come
/// to the same bits.
inline __attribute__((always_inline)) Floats& rounded(Floats&& product) {
  asm("" : "+m"(product));
  return product;
}

/// Appends the block's rows to the segments, in ray order, and writes them to `rows` with zeros where lanes
/// have ended.
ROXEL_KERNEL void fold_rows(const StepRows& steps, int first, int count, const MatchBlock& block,
                            PacketSegments& segments, EvaluatedRow* rows) {
  Floats total_t, total_l, brick_t, brick_l;
  Ints running, taken;
  load(segments.transmittance, total_t);
  load(segments.likelihood, total_l);
  load(segments.transmittance_in_brick, brick_t);
  load(segments.likelihood_in_brick, brick_l);
  load(segments.running, running);
  load(segments.steps, taken);
  const Floats one = Floats{} + 1.0f;
  const Ints lane_bits = {1, 2, 4, 8, 16, 32, 64, 128};
  for (int row = 0; row < count; ++row) {
    const int i = row * kLanes;
    const Ints begins = (lane_bits & static_cast<std::int32_t>(steps.begins[first + row])) != 0;
    total_l = begins ? total_l + rounded(total_t * brick_l) : total_l;
    total_t = begins ? total_t * brick_t : total_t;
    brick_l = begins ? Floats{} : brick_l;
    brick_t = begins ? one : brick_t;
    running &= ~(begins & (total_t < SegmentMarch::kNegligible * total_l));

    Floats opacity, likelihood, length, weight, mean_path;
    load(block.opacity + i, opacity);
    load(block.likelihood + i, likelihood);
    load(block.length + i, length);
    load(block.mean_path + i, mean_path);
    load(steps.weight[first + row], weight);
    opacity = running ? opacity : Floats{};
    length = running ? length : Floats{};
    mean_path = running ? mean_path : Floats{};
    weight = running ? weight : Floats{};
    taken -= length > 0.0f;
    brick_l += brick_t * opacity * likelihood;
    brick_t *= 1.0f - opacity;

    EvaluatedRow& to = rows[row];
    Ints slots;
    load(steps.slot[first + row], slots);
    store(slots, to.slot);
    store(length, to.length);
    store(weight, to.weight);
    store(opacity, to.opacity);
    store(likelihood, to.likelihood);
    store(mean_path, to.mean_path);
  }
  store(total_t, segments.transmittance);
  store(total_l, segments.likelihood);
  store(brick_t, segments.transmittance_in_brick);
  store(brick_l, segments.likelihood_in_brick);
  store(running, segments.running);
  store(taken, segments.steps);
}

ROXEL_KERNEL void distribute_rows(const EvaluatedRow* begin, const EvaluatedRow* end, bool ray_weights,
                                  PacketReach& lanes, VoxelScratch* voxels) {
  static_assert(offsetof(VoxelScratch, exposure) == offsetof(VoxelScratch, hits) + sizeof(float) &&
                offsetof(VoxelScratch, looked) == offsetof(VoxelScratch, hits) + 2 * sizeof(float));
  Floats reach, z, node_weight;
  load(lanes.reach, reach);
  load(lanes.z, z);
  load(lanes.weight, node_weight);
  const Floats one = Floats{} + 1.0f;
  const Floats scale = z > 0.0f ? reach / (z > 0.0f ? z : one) : Floats{};
  Floats remaining = z > 0.0f ? reach : Floats{}, transmittance = one;
  for (const EvaluatedRow* row = begin; row != end; ++row) {
    Floats opacity, likelihood, length, weight, mean_path;
    load(row->opacity, opacity);
    load(row->likelihood, likelihood);
    load(row->length, length);
    load(row->weight, weight);
    load(row->mean_path, mean_path);
    const Floats share = scale * transmittance * opacity * likelihood;
    const Floats r = share < remaining ? share : remaining;
    const Floats w = ray_weights ? node_weight * weight : node_weight;
    const Floats sums[4] = {w * r, w * ((remaining - r) * length + r * mean_path), remaining * weight, {}};
    alignas(32) float of_lane[kLanes][4];
    transpose(sums, of_lane);
#pragma GCC unroll 8
    for (int lane = 0; lane < kLanes; ++lane) {
      float* voxel = &voxels[row->slot[lane]].hits;
      FourFloats old, mine;
      load(voxel, old);
      load(of_lane[lane], mine);
      const FourFloats sum = old + mine;
      const FourFloats most = old > mine ? old : mine;
      store(__builtin_shufflevector(sum, most, 0, 1, 6, 3), voxel);
    }
    remaining -= r;
    transmittance *= 1.0f - opacity;
  }
  store(transmittance, lanes.transmittance);
}

}  // namespace

EvaluatedRow* EvaluatedRows::append(std::size_t count) {
  if (size_ + count > capacity_) {
    capacity_ = 2 * (size_ + count);
    std::unique_ptr<EvaluatedRow[]> larger(new EvaluatedRow[capacity_]);
    std::copy(rows_.get(), rows_.get() + size_, larger.get());
    rows_ = std::move(larger);
  }
  return rows_.get() + std::exchange(size_, size_ + count);
}

PacketSegments::PacketSegments() {
  for (int lane = 0; lane < kLanes; ++lane) {
    transmittance[lane] = transmittance_in_brick[lane] = 1;
    likelihood[lane] = likelihood_in_brick[lane] = 0;
    running[lane] = -1;
    steps[lane] = 0;
  }
}

PacketSegments PacketMarch::march(const LaneTerms& samples, EvaluatedRows& rows) {
  PacketSegments segments;
  while (walk_.next(steps_)) {
    for (int b = 0; b < steps_.brick_count; ++b) scratch_.enter(steps_.bricks[b]);
    for (int row = 0; row < steps_.rows; ++row)
      for (const std::uint32_t slot : steps_.slot[row]) __builtin_prefetch(&scratch_[slot]);
    EvaluatedRow* to = rows.append(steps_.rows);
    for (int first = 0; first < steps_.rows; first += kBlockRows) {
      const int count = std::min(kBlockRows, steps_.rows - first);
      std::memcpy(block_.length, steps_.length[first], sizeof(float) * kLanes * count);
      gather_voxels(scratch_.voxels(), steps_.slot[first], count * kLanes, samples, block_);
      evaluate_match(model_, samples, count * kLanes, block_);
      fold_rows(steps_, first, count, block_, segments, to + first);
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      const Segment so_far = segments.of(lane);
      if (!segments.running[lane] || so_far.transmittance < SegmentMarch::kNegligible * so_far.likelihood)
        walk_.stop(lane);
    }
  }
  return segments;
}

void PacketMarch::distribute(const EvaluatedRow* begin, const EvaluatedRow* end, bool ray_weights,
                             PacketReach& lanes) {
  distribute_rows(begin, end, ray_weights, lanes, scratch_.voxels());
}

}  // namespace roxel

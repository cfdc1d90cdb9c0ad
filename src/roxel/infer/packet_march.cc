#include "roxel/infer/packet_march.h"

#include <cstring>

#include "roxel/infer/gather.h"
#include "roxel/infer/segment_march.h"

namespace roxel {

namespace {

/// In whole vectors: both have room for them behind the count.
template <class Number>
inline void copy_padded(const Number* from, std::size_t count, Number* to) {
  constexpr std::size_t kAtOnce = kMaxPacketRays;
  for (std::size_t i = 0; i < count; i += kAtOnce) std::memcpy(to + i, from + i, kAtOnce * sizeof(Number));
}

}  // namespace

PacketSegments PacketMarch::march(int count, const PacketTerms& samples, PacketRecord& record) {
  PacketSegments segments;
  while (walk_.next(steps_)) {
    if (steps_.count == 0) continue;
    evaluate(samples, segments, record);
    for (int ray = 0; ray < count; ++ray)
      if (segments.transmittance[ray] < SegmentMarch::kNegligible * segments.likelihood[ray]) walk_.stop(ray);
  }
  return segments;
}

/// Matches the steps' voxels with their samples, folds them into the segments and records them.
void PacketMarch::evaluate(const PacketTerms& samples, PacketSegments& segments, PacketRecord& record) {
  const std::size_t count = static_cast<std::size_t>(steps_.count);
  for (int b = 0; b < steps_.brick_count; ++b) scratch_.enter(steps_.bricks[b]);
  for (std::size_t i = 0; i < count; ++i) __builtin_prefetch(&scratch_[steps_.slot[i]]);
  copy_padded(steps_.length, count, block_.length);
  gather_voxels(scratch_.voxels(), steps_.slot, steps_.count, block_);
  bring_in_samples(samples, steps_, block_);
  evaluate_match(model_, steps_.count, block_);
  const std::size_t at = record.append(count);
  copy_padded(steps_.slot, count, record.slot() + at);
  copy_padded(steps_.ray, count, record.ray() + at);
  copy_padded(steps_.length, count, record.length() + at);
  copy_padded(steps_.weight, count, record.weight() + at);
  copy_padded(block_.mean_path, count, record.mean_path() + at);
  fold_steps(steps_, block_, segments, record.share() + at, record.before() + at);
}

}  // namespace roxel

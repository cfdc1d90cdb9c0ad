#include "roxel/infer/packet_march.h"

#include <cstring>

#include "roxel/infer/gather.h"
#include "roxel/infer/segment_march.h"

namespace roxel {

PacketSegments PacketMarch::march(int count, const PacketTerms& samples, PacketRecord& record) {
  PacketSegments segments;
  while (walk_.next(steps_)) {
    if (steps_.count == 0) continue;
    evaluate(samples, segments, record);
    for (int ray = 0; ray < count; ++ray)
      if (segments.transmittance[ray] < SegmentMarch::kNegligible * segments.likelihood[ray])
        walk_.stop(ray);
  }
  return segments;
}

/// Matches the steps' voxels with their samples, folds them into the segments and records them.
void PacketMarch::evaluate(const PacketTerms& samples, PacketSegments& segments, PacketRecord& record) {
  const std::size_t count = static_cast<std::size_t>(steps_.count);
  for (int b = 0; b < steps_.brick_count; ++b) scratch_.enter(steps_.bricks[b]);
  for (std::size_t i = 0; i < count; ++i) __builtin_prefetch(&scratch_[steps_.slot[i]]);
  std::memcpy(block_.length, steps_.length, count * sizeof(float));
  gather_voxels(scratch_.voxels(), steps_.slot, steps_.count, block_);
  bring_in_samples(samples, steps_, block_);
  evaluate_match(model_, steps_.count, block_);
  const std::size_t at = record.append(count);
  std::memcpy(record.slot() + at, steps_.slot, count * sizeof(std::uint32_t));
  std::memcpy(record.ray() + at, steps_.ray, count * sizeof(std::int32_t));
  std::memcpy(record.length() + at, steps_.length, count * sizeof(float));
  std::memcpy(record.weight() + at, steps_.weight, count * sizeof(float));
  std::memcpy(record.mean_path() + at, block_.mean_path, count * sizeof(float));
  fold_steps(steps_, block_, segments, record.share() + at, record.before() + at);
}

}  // namespace roxel

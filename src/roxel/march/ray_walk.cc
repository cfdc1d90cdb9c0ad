#include "roxel/march/ray_walk.h"

#include "roxel/base/kernel.h"

namespace roxel {

namespace {

/// The point `near` as whole cells (with the code's offset) and the rest: only the small rest is rounded.
struct NearPoint {
  std::int32_t whole[3];
  float rest[3];
};

ROXEL_KERNEL void add_bits(const std::uint32_t* words, int count, std::uint32_t* sums) {
  const int padded = (count + 7) / 8 * 8;
  for (int i = 0; i < padded; ++i) {  // side by side, as not every processor can count bits
    std::uint32_t bits = words[i];
    bits -= bits >> 1 & 0x55555555u;
    bits = (bits & 0x33333333u) + (bits >> 2 & 0x33333333u);
    sums[i] += (((bits + (bits >> 4)) & 0x0f0f0f0fu) * 0x01010101u) >> 24;
  }
}

ROXEL_KERNEL void complete_steps(const CellCode* cells, const std::int32_t* units, int count,
                                 const float u[3], const NearPoint& near, float* lengths, float* weights) {
  using namespace internal;
  constexpr float kInverseVertexDistance = 1.1547005383792515f;
  const float ux = u[0], uy = u[1], uz = u[2];
  const float rest_x = near.rest[0], rest_y = near.rest[1], rest_z = near.rest[2];
  const std::int32_t whole_x = near.whole[0], whole_y = near.whole[1], whole_z = near.whole[2];
  const int padded = (count + 7) / 8 * 8;  // whole eighths; what lies behind the count is left unread
  for (int i = 0; i < padded; ++i) {
    const CellCode code = cells[i];
    const float x = static_cast<float>(static_cast<std::int32_t>(code & kCellField) - whole_x) - rest_x;
    const float y =
        static_cast<float>(static_cast<std::int32_t>(code >> kCellBits & kCellField) - whole_y) - rest_y;
    const float z = static_cast<float>(static_cast<std::int32_t>(code >> 2 * kCellBits) - whole_z) - rest_z;
    // A cross product: |p|^2 - (p u)^2 would lose the digits of d far from `near`.
    const float cx = y * uz - z * uy, cy = z * ux - x * uz, cz = x * uy - y * ux;
    const float d = std::sqrt(cx * cx + cy * cy + cz * cz) * kInverseVertexDistance;
    lengths[i] = static_cast<float>(units[i]) * static_cast<float>(kWalkUnit);
    weights[i] = d < 1 ? 1 - d : 0.0f;
  }
}

}  // namespace

void StepChunk::complete(const float direction[3], const double near[3]) {
  NearPoint point;
  for (int a = 0; a < 3; ++a) {
    const double whole = std::floor(near[a]);
    point.whole[a] = static_cast<std::int32_t>(whole) + internal::kCellOffset;
    point.rest[a] = static_cast<float>(near[a] - whole - 0.5);  // voxel centres are at + 0.5
  }
  add_bits(below_, count, slot);
  complete_steps(cell, units, count, direction, point, length, weight);
}

}  // namespace roxel

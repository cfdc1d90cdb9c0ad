#include "roxel/infer/evidence.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <thread>

#include "roxel/base/error.h"
#include "roxel/base/kernel.h"
#include "roxel/base/parallel.h"

namespace roxel {

namespace {

constexpr float kLargestColor = 1023.0f;
constexpr float kLargestOpacitySum = 1 << 20;

static_assert(sizeof(VoxelColor) == 10 * sizeof(float), "as the first ten numbers of VoxelScratch");

/// The nearest whole number of value * unit, below 2^51. What is added leaves no room for fractions: as plain
/// arithmetic it vectorises.
inline __attribute__((always_inline)) std::int64_t fixed(double value, double unit) {
  constexpr double kNoFractions = 0x1.8p52;
  return std::bit_cast<std::int64_t>(value * unit + kNoFractions) - std::bit_cast<std::int64_t>(kNoFractions);
}

/// capped_color of a voxel with evidence.
inline __attribute__((always_inline)) void cap_color(const VoxelScratch& voxel, ColorTotals& totals) {
  const double weight = voxel.evidence;
  const double scale = std::min(1.0, weight) / weight;
  totals[0] = fixed(weight * scale, kColorUnit);
  const auto bounded = [scale](float sum, double limit) {
    return fixed(std::clamp(sum * scale, -limit, limit), kColorUnit);
  };
  for (int c = 0; c < 3; ++c) totals[1 + c] = bounded(voxel.mean[c], kLargestColor);
  for (int c = 0; c < 6; ++c) totals[4 + c] = bounded(voxel.cov[c], kLargestColor * kLargestColor);
}

/// Whether no principal minor of the covariance (xx, yy, zz, xy, xz, yz) is negative.
bool semi_definite(const double s[6]) {
  const double determinant = s[0] * (s[1] * s[2] - s[5] * s[5]) + s[3] * (s[5] * s[4] - s[3] * s[2]) +
                             s[4] * (s[3] * s[5] - s[1] * s[4]);
  return s[0] * s[1] >= s[3] * s[3] && s[0] * s[2] >= s[4] * s[4] && s[1] * s[2] >= s[5] * s[5] &&
         determinant >= 0;
}

/// Few colours have a covariance of low rank, which rounding makes indefinite by a hair half of the time:
/// raises the variances by what the difference of moments of size `moment` may have lost, and on until it is
/// enough.
void make_semi_definite(double moment, double s[6]) {
  for (double lost = 1e-7 * moment; !semi_definite(s) && lost < moment; lost *= 4)
    for (int c = 0; c < 3; ++c) s[c] += lost;
  if (!semi_definite(s)) s[3] = s[4] = s[5] = 0;
}

inline __attribute__((always_inline)) void color_of_sums(const ColorTotals& totals, float mean[3],
                                                         float cov[6], float& weight) {
  weight = static_cast<float>(totals[0] / kColorUnit);
  if (totals[0] <= 0) {
    std::fill(mean, mean + 3, 0.0f);
    std::fill(cov, cov + 6, 0.0f);
    weight = 0;
    return;
  }
  const double inverse = 1.0 / static_cast<double>(totals[0]);
  double m[3], s[6];
  for (int c = 0; c < 3; ++c) m[c] = totals[1 + c] * inverse;
  for (int c = 0; c < 6; ++c) s[c] = totals[4 + c] * inverse;
  s[0] = std::max(0.0, s[0] - m[0] * m[0]);
  s[1] = std::max(0.0, s[1] - m[1] * m[1]);
  s[2] = std::max(0.0, s[2] - m[2] * m[2]);
  s[3] -= m[0] * m[1];
  s[4] -= m[0] * m[2];
  s[5] -= m[1] * m[2];
  make_semi_definite(m[0] * m[0] + m[1] * m[1] + m[2] * m[2] + s[0] + s[1] + s[2], s);
  for (int c = 0; c < 3; ++c) mean[c] = static_cast<float>(m[c]);
  for (int c = 0; c < 6; ++c) cov[c] = static_cast<float>(s[c]);
}

/// Adds the capped colours of a brick's voxels to their totals.
ROXEL_KERNEL void add_colors(const VoxelScratch* voxels, std::uint32_t count, ColorTotals* totals) {
  for (std::uint32_t i = 0; i < count; ++i) {
    if (voxels[i].evidence <= 0) continue;
    ColorTotals own;
    cap_color(voxels[i], own);
    for (int c = 0; c < 10; ++c) totals[i][c] += own[c];
  }
}

ROXEL_KERNEL void add_opacities(const VoxelScratch* voxels, std::uint32_t count, OpacityTotals* totals) {
  for (std::uint32_t i = 0; i < count; ++i) {
    const float sums[3] = {voxels[i].hits, voxels[i].exposure, voxels[i].looked};
    for (int k = 0; k < 3; ++k)
      totals[i][k] += fixed(sums[k] < kLargestOpacitySum ? sums[k] : kLargestOpacitySum, kOpacityUnit);
  }
}

ROXEL_KERNEL void make_colors(const ColorTotals* totals, std::int64_t count, VoxelColor* colors) {
  for (std::int64_t i = 0; i < count; ++i)
    color_of_sums(totals[i], colors[i].mean, colors[i].cov, colors[i].evidence);
}

/// Turns a voxel's own sums into what the other nodes say: the totals less the voxel's own.
ROXEL_KERNEL void leave_out_own(const ColorTotals& totals, VoxelScratch& voxel) {
  ColorTotals others, own;
  cap_color(voxel, own);
  for (int c = 0; c < 10; ++c) others[c] = totals[c] - own[c];
  color_of_sums(others, voxel.mean, voxel.cov, voxel.evidence);
}

template <class Visit>
void for_each_entered_slot(const LatticeStack& stack, const NodeScratch& node, Visit&& visit) {
  for (const std::uint32_t number : node.entered_bricks()) {
    const Brick& brick = stack.brick(number);
    visit(number, brick.first_slot, brick.first_slot + brick.count);
  }
}

}  // namespace

NodeScratch::NodeScratch(const LatticeStack& stack, const std::vector<float>& tau)
    : stack_(&stack),
      tau_(tau.data()),
      voxels_(new VoxelScratch[stack.volume().slot_count()]),
      entered_(stack.brick_count(), 0) {}

void NodeScratch::set_up_brick(std::uint32_t number) {
  entered_[number] = 1;
  order_.push_back(number);
  const Brick& brick = stack_->brick(number);
  for (std::uint32_t slot = brick.first_slot; slot < brick.first_slot + brick.count; ++slot) {
    VoxelScratch& voxel = voxels_[slot];
    voxel = VoxelScratch{};
    voxel.tau = tau_[slot];
    if (totals_) look_up(slot, voxel);
  }
}

void NodeScratch::look_up(std::uint32_t slot, VoxelScratch& voxel) const {
  if (!colors_) return color_of(totals_[slot], voxel.mean, voxel.cov, voxel.evidence);
  std::memcpy(static_cast<void*>(&voxel), &colors_[slot], sizeof(VoxelColor));
}

OwnColors::Entry OwnColors::Entry::of(std::uint32_t slot, const VoxelScratch& voxel) {
  Entry entry{slot, {}};
  std::memcpy(&entry.color, static_cast<const void*>(&voxel), sizeof(VoxelColor));
  return entry;
}

void NodeScratch::compare_with(const std::vector<ColorTotals>& totals,
                               const std::vector<VoxelColor>* colors) {
  totals_ = totals.data();
  colors_ = colors ? colors->data() : nullptr;
  for_each_entered_slot(*stack_, *this, [&](std::uint32_t, std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t slot = begin; slot < end; ++slot) {
      VoxelScratch& voxel = voxels_[slot];
      if (voxel.evidence > 0) {
        leave_out_own(totals_[slot], voxel);
      } else {
        look_up(slot, voxel);
      }
      voxel.hits = voxel.exposure = voxel.looked = 0;
    }
  });
}

void NodeScratch::compare_with(const std::vector<ColorTotals>& totals, const std::vector<VoxelColor>* colors,
                               const OwnColors& own) {
  compare_with(totals, colors);
  const OwnColors::Entry* entry = own.entries.data();
  for (const OwnColors::BrickPart& part : own.bricks) {
    enter(part.brick);
    for (std::uint32_t i = 0; i < part.count; ++i, ++entry) {
      VoxelScratch& voxel = voxels_[entry->slot];
      std::memcpy(static_cast<void*>(&voxel), &entry->color, sizeof(VoxelColor));
      leave_out_own(totals_[entry->slot], voxel);
    }
  }
}

void NodeScratch::reset() {
  for (const std::uint32_t number : order_) entered_[number] = 0;
  order_.clear();
  totals_ = nullptr;
  colors_ = nullptr;
}

void NodeScratch::reset(const LatticeStack& stack, const std::vector<float>& tau) {
  ROXEL_CHECK(stack.brick_count() == entered_.size());
  reset();
  stack_ = &stack;
  tau_ = tau.data();
}

ColorTotals capped_color(const VoxelScratch& voxel) {
  ColorTotals totals{};
  if (voxel.evidence > 0) cap_color(voxel, totals);
  return totals;
}

/// A spin lock over a brick's totals; bricks share kLocks locks.
class Totals::BrickLock {
 public:
  BrickLock(Totals& totals, std::uint32_t brick) : flag_(totals.locks_[brick % kLocks]) {
    while (flag_.test_and_set(std::memory_order_acquire)) std::this_thread::yield();
  }
  ~BrickLock() { flag_.clear(std::memory_order_release); }

 private:
  std::atomic_flag& flag_;
};

Totals::Totals(std::uint32_t slot_count) : color(slot_count), opacity(slot_count) {}

void Totals::clear_color() { std::fill(color.begin(), color.end(), ColorTotals{}); }
void Totals::clear_opacity() { std::fill(opacity.begin(), opacity.end(), OpacityTotals{}); }

void Totals::add_color(const LatticeStack& stack, const NodeScratch& node, OwnColors* own) {
  if (own) {  // room for all, of which only what is written takes memory
    std::size_t entered = 0;
    for (const std::uint32_t number : node.entered_bricks()) entered += stack.brick(number).count;
    own->entries.reserve(entered);
  }
  for_each_entered_slot(stack, node, [&](std::uint32_t brick, std::uint32_t begin, std::uint32_t end) {
    {
      const BrickLock lock(*this, brick);
      add_colors(&node[begin], end - begin, &color[begin]);
    }
    if (!own) return;
    const std::size_t before = own->entries.size();
    for (std::uint32_t slot = begin; slot < end; ++slot)
      if (node[slot].evidence > 0) own->entries.push_back(OwnColors::Entry::of(slot, node[slot]));
    const std::size_t count = own->entries.size() - before;
    if (count > 0) own->bricks.push_back({brick, static_cast<std::uint32_t>(count)});
  });
}

void Totals::add_opacity(const LatticeStack& stack, const NodeScratch& node) {
  for_each_entered_slot(stack, node, [&](std::uint32_t brick, std::uint32_t begin, std::uint32_t end) {
    const BrickLock lock(*this, brick);
    add_opacities(&node[begin], end - begin, &opacity[begin]);
  });
}

void color_of(const ColorTotals& totals, float mean[3], float cov[6], float& weight) {
  VoxelColor color;
  make_colors(&totals, 1, &color);
  std::copy(color.mean, color.mean + 3, mean);
  std::copy(color.cov, color.cov + 6, cov);
  weight = color.evidence;
}

void colors_of(const std::vector<ColorTotals>& totals, int threads, std::vector<VoxelColor>& colors) {
  colors.resize(totals.size());
  parallel_for_blocks(totals.size(), 1 << 14, threads, [&](std::int64_t begin, std::int64_t end, int) {
    make_colors(&totals[begin], end - begin, &colors[begin]);
  });
}

}  // namespace roxel

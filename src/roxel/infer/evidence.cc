#include "roxel/infer/evidence.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <thread>

#include "roxel/base/error.h"
#include "roxel/base/kernel.h"
#include "roxel/base/lanes.h"
#include "roxel/base/parallel.h"

namespace roxel {

namespace {

constexpr float kLargestColor = 1023.0f;
constexpr float kLargestOpacitySum = 1 << 20;

/// The first eight of the nine sums of colours, as they follow one another in VoxelScratch (from `mean`) and
/// in ColorTotals (from the second): x, y, z, xx, yy, zz, xy, xz. The ninth, yz, goes beside them.
using EightSums = double __attribute__((vector_size(64)));
using EightTotals = std::int64_t __attribute__((vector_size(64)));
static_assert(sizeof(VoxelColor) == 10 * sizeof(float), "as the first ten numbers of VoxelScratch");

constexpr double kLargestMoment = kLargestColor * kLargestColor;
constexpr EightSums kLargestSums = {kLargestColor,  kLargestColor,  kLargestColor,  kLargestMoment,
                                    kLargestMoment, kLargestMoment, kLargestMoment, kLargestMoment};

/// The nearest whole number of value * unit, below 2^51. What is added leaves no room for fractions: as plain
/// arithmetic it vectorises.
constexpr double kNoFractions = 0x1.8p52;
inline __attribute__((always_inline)) std::int64_t fixed(double value, double unit) {
  return std::bit_cast<std::int64_t>(value * unit + kNoFractions) - std::bit_cast<std::int64_t>(kNoFractions);
}

struct CappedColor {
  std::int64_t weight, yz;
  EightTotals sums;
};

/// capped_color of a voxel with evidence.
inline __attribute__((always_inline)) void cap_color(const VoxelScratch& voxel, CappedColor& capped) {
  const double weight = voxel.evidence;
  const double scale = std::min(1.0, weight) / weight;
  Floats stored;
  load(voxel.mean, stored);
  EightSums sums = __builtin_convertvector(stored, EightSums) * scale;
  sums = sums > kLargestSums ? kLargestSums : sums;
  sums = sums < -kLargestSums ? -kLargestSums : sums;
  capped.weight = fixed(weight * scale, kColorUnit);
  capped.yz = fixed(std::clamp(voxel.cov[5] * scale, -kLargestMoment, kLargestMoment), kColorUnit);
  capped.sums = reinterpret_cast<EightTotals>(sums * kColorUnit + kNoFractions) -
                std::bit_cast<std::int64_t>(kNoFractions);
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

/// Mean, covariance and weight of fixed-point sums, to ten numbers in the order of VoxelColor.
inline __attribute__((always_inline)) void color_of_sums(std::int64_t weight, const EightTotals& totals,
                                                         std::int64_t yz, float color[10]) {
  if (weight <= 0) {
    std::fill(color, color + 10, 0.0f);
    return;
  }
  const double inverse = 1.0 / static_cast<double>(weight);
  const EightSums moments = __builtin_convertvector(totals, EightSums) * inverse;
  const EightSums left = __builtin_shufflevector(moments, moments, 0, 1, 2, 0, 1, 2, 0, 0);
  const EightSums right = __builtin_shufflevector(moments, moments, 0, 1, 2, 0, 1, 2, 1, 2);
  constexpr EightSums kCentral = {0, 0, 0, 1, 1, 1, 1, 1};
  EightSums central = moments - kCentral * left * right;
  constexpr EightSums kAny = {-1e300, -1e300, -1e300, 0, 0, 0, -1e300, -1e300};
  central = central < kAny ? kAny : central;  // variances are not negative
  double s[6] = {central[3], central[4], central[5],
                 central[6], central[7], static_cast<double>(yz) * inverse - moments[1] * moments[2]};
  if (!semi_definite(s)) {
    const double moment = moments[0] * moments[0] + moments[1] * moments[1] + moments[2] * moments[2];
    make_semi_definite(moment + s[0] + s[1] + s[2], s);
    central = EightSums{moments[0], moments[1], moments[2], s[0], s[1], s[2], s[3], s[4]};
  }
  store(__builtin_convertvector(central, Floats), color);
  color[8] = static_cast<float>(s[5]);
  color[9] = static_cast<float>(static_cast<double>(weight) / kColorUnit);
}

/// Adds the capped colours of a brick's voxels to their totals.
ROXEL_KERNEL void add_colors(const VoxelScratch* voxels, std::uint32_t count, ColorTotals* totals) {
  for (std::uint32_t i = 0; i < count; ++i) {
    if (voxels[i].evidence <= 0) continue;
    CappedColor own;
    cap_color(voxels[i], own);
    std::int64_t* const to = totals[i].data();
    EightTotals sums;
    load(to + 1, sums);
    store(sums + own.sums, to + 1);
    to[0] += own.weight;
    to[9] += own.yz;
  }
}

ROXEL_KERNEL void add_opacities(const VoxelScratch* voxels, std::uint32_t count, OpacityTotals* totals) {
  for (std::uint32_t i = 0; i < count; ++i) {
    const float sums[3] = {voxels[i].hits, voxels[i].exposure, voxels[i].looked};
    for (int k = 0; k < 3; ++k)
      totals[i][k] += fixed(sums[k] < kLargestOpacitySum ? sums[k] : kLargestOpacitySum, kOpacityUnit);
  }
}

/// The totals' colour, to ten numbers in the order of VoxelColor and VoxelScratch.
inline __attribute__((always_inline)) void look_up(const ColorTotals& totals, float color[10]) {
  EightTotals sums;
  load(totals.data() + 1, sums);
  color_of_sums(totals[0], sums, totals[9], color);
}

ROXEL_KERNEL void make_color(const ColorTotals& totals, VoxelColor& color) { look_up(totals, color.mean); }

/// Makes a voxel hold what the other nodes say: the totals less its own sums.
inline __attribute__((always_inline)) void leave_out(const ColorTotals& totals, VoxelScratch& voxel) {
  CappedColor own;
  cap_color(voxel, own);
  EightTotals sums;
  load(totals.data() + 1, sums);
  color_of_sums(totals[0] - own.weight, sums - own.sums, totals[9] - own.yz, voxel.mean);
}

/// Voxels with a node's own sums get what the others say, and no opacity sums.
ROXEL_KERNEL void leave_out_own(const ColorTotals* totals, std::uint32_t count, VoxelScratch* voxels) {
  for (std::uint32_t i = 0; i < count; ++i) {
    if (voxels[i].evidence > 0)
      leave_out(totals[i], voxels[i]);
    else
      look_up(totals[i], voxels[i].mean);
    voxels[i].hits = voxels[i].exposure = voxels[i].looked = 0;
  }
}

/// Sets voxels up that hold no sums yet: their tau, and the totals' colours, unless null.
ROXEL_KERNEL void set_up(const float* tau, const ColorTotals* totals, std::uint32_t count,
                         VoxelScratch* voxels) {
  static_assert(offsetof(VoxelScratch, evidence) == 9 * sizeof(float) &&
                offsetof(VoxelScratch, tau) == 10 * sizeof(float) &&
                sizeof(VoxelScratch) == 2 * sizeof(Floats));
  for (std::uint32_t i = 0; i < count; ++i) {
    const Floats low{}, high = {0, 0, tau[i]};
    store(low, voxels[i].mean);
    store(high, voxels[i].mean + kLanes);
    if (totals) look_up(totals[i], voxels[i].mean);
  }
}

/// The same, without what the node itself says of the brick whose first slot is given: its entries.
ROXEL_KERNEL void set_up_others(const float* tau, const ColorTotals* totals, std::uint32_t first_slot,
                                std::uint32_t count, const OwnColors::Entry* entries,
                                std::uint32_t entry_count, VoxelScratch* voxels) {
  const OwnColors::Entry* const end = entries + entry_count;
  for (std::uint32_t i = 0; i < count; ++i) {
    Floats low{}, high = {0, 0, tau[i]};
    const bool has_own = entries < end && entries->slot == first_slot + i;
    if (has_own) {
      load(entries->color.mean, low);
      high[0] = entries->color.cov[5];
      high[1] = entries->color.evidence;
      ++entries;
    }
    store(low, voxels[i].mean);
    store(high, voxels[i].mean + kLanes);
    if (has_own)
      leave_out(totals[i], voxels[i]);
    else
      look_up(totals[i], voxels[i].mean);
  }
}

template <class Visit>
void for_each_entered_slot(const LatticeStack& stack, const NodeScratch& node, Visit&& visit) {
  for (const std::uint32_t number : node.entered_bricks()) {
    const Brick& brick = stack.brick(number);
    visit(number, brick.first_slot, brick.first_slot + brick.count());
  }
}

}  // namespace

NodeScratch::NodeScratch(const LatticeStack& stack, const std::vector<float>& tau)
    : stack_(&stack),
      tau_(tau.data()),
      voxels_(new VoxelScratch[stack.volume().slot_count()]),
      entered_(stack.brick_count(), 0) {}

void NodeScratch::set_up_brick(std::uint32_t number) {
  const Brick& brick = note(number);
  const std::uint32_t first = brick.first_slot;
  set_up(tau_ + first, totals_ ? totals_ + first : nullptr, brick.count(), &voxels_[first]);
}

const Brick& NodeScratch::note(std::uint32_t number) {
  entered_[number] = 1;
  order_.push_back(number);
  return stack_->brick(number);
}

OwnColors::Entry OwnColors::Entry::of(std::uint32_t slot, const VoxelScratch& voxel) {
  Entry entry{slot, {}};
  std::memcpy(&entry.color, static_cast<const void*>(&voxel), sizeof(VoxelColor));
  return entry;
}

void NodeScratch::compare_with(const std::vector<ColorTotals>& totals) {
  totals_ = totals.data();
  for_each_entered_slot(*stack_, *this, [&](std::uint32_t, std::uint32_t begin, std::uint32_t end) {
    leave_out_own(totals_ + begin, end - begin, &voxels_[begin]);
  });
}

void NodeScratch::compare_with(const std::vector<ColorTotals>& totals, const OwnColors& own) {
  ROXEL_CHECK(order_.empty());
  totals_ = totals.data();
  const OwnColors::Entry* entry = own.entries.data();
  for (const OwnColors::BrickPart& part : own.bricks) {
    const Brick& brick = note(part.brick);
    const std::uint32_t first = brick.first_slot;
    set_up_others(tau_ + first, totals_ + first, first, brick.count(), entry, part.count, &voxels_[first]);
    entry += part.count;
  }
}

void NodeScratch::reset() {
  for (const std::uint32_t number : order_) entered_[number] = 0;
  order_.clear();
  totals_ = nullptr;
}

void NodeScratch::reset(const LatticeStack& stack, const std::vector<float>& tau) {
  ROXEL_CHECK(stack.brick_count() == entered_.size());
  reset();
  stack_ = &stack;
  tau_ = tau.data();
}

ColorTotals capped_color(const VoxelScratch& voxel) {
  ColorTotals totals{};
  add_colors(&voxel, 1, &totals);
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
    for (const std::uint32_t number : node.entered_bricks()) entered += stack.brick(number).count();
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

VoxelColor color_of(const ColorTotals& totals) {
  VoxelColor color;
  make_color(totals, color);
  return color;
}

}  // namespace roxel

#include "roxel/march/packet_kernels.h"

#include <algorithm>
#include <cstddef>

#include "roxel/base/vector_targets.h"
#include "roxel/volume/volume.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "roxel/march/packet_kernels.cc"
#include <hwy/foreach_target.h>  // before highway.h

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace roxel::internal {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using FloatTag = hn::CappedTag<float, kMaxPacketRays>;
using IntTag = hn::RebindToSigned<FloatTag>;
using UnsignedTag = hn::RebindToUnsigned<FloatTag>;
using DoubleTag = hn::CappedTag<double, kMaxPacketRays / 2>;
using HalfFloatTag = hn::Rebind<float, DoubleTag>;
using HalfIntTag = hn::Rebind<std::int32_t, DoubleTag>;
using FloatVector = hn::Vec<FloatTag>;
using IntVector = hn::Vec<IntTag>;

constexpr int kRays = static_cast<int>(hn::MaxLanes(FloatTag()));
constexpr int kHalf = static_cast<int>(hn::MaxLanes(DoubleTag()));  ///< rays in a vector of doubles

int lanes() { return kRays; }

void prepare(PacketRays& rays) {
  const DoubleTag d;
  const HalfIntTag di;
  const HalfFloatTag df;
  const auto one = hn::Set(d, 1.0), zero = hn::Zero(d);
  const auto per_unit = hn::Set(d, 1 / kPacketUnit), unit_size = hn::Set(d, kPacketUnit);
  const auto least = hn::Set(d, 1.0 / (1 << 30)), far = hn::Set(d, kPacketFar);
  for (int i = 0; i < kRays; i += kHalf) {
    hn::Vec<DoubleTag> direction[3];
    auto squared = zero;
    for (int a = 0; a < 3; ++a) {
      direction[a] = hn::Load(d, rays.direction[a] + i);
      squared = hn::MulAdd(direction[a], direction[a], squared);
    }
    const auto norm = hn::Sqrt(squared);
    const auto inverse_norm = hn::Div(one, norm);
    hn::Store(hn::Mul(norm, per_unit), d, rays.arc_per_depth + i);
    for (int a = 0; a < 3; ++a) {
      const auto share = hn::Mul(direction[a], inverse_norm);
      const auto back = hn::Lt(share, zero);
      const auto size = hn::Max(hn::Abs(share), least);
      const auto unit = hn::IfThenElse(back, hn::Neg(size), size);
      const auto distance = hn::Mul(hn::Div(one, size), per_unit);
      const auto sign = hn::IfThenElse(back, hn::Set(d, -1.0), one);
      hn::Store(hn::Mul(hn::Div(one, unit), inverse_norm), d, rays.inverse[a] + i);
      hn::Store(distance, d, rays.distance[a] + i);
      hn::Store(hn::Mul(size, unit_size), d, rays.per_distance[a] + i);
      hn::Store(hn::DemoteTo(df, unit), df, rays.unit[a] + i);
      hn::Store(hn::DemoteTo(df, sign), df, rays.sign[a] + i);
      hn::Store(hn::DemoteTo(df, hn::IfThenElseZero(hn::Not(back), hn::Set(d, kBrickSide))), df,
                rays.last_place[a] + i);
      const double cell_step = 1 << 3 * a;
      hn::Store(hn::DemoteTo(di, hn::Mul(sign, hn::Set(d, cell_step))), di, rays.step[a] + i);
      hn::Store(hn::DemoteTo(di, hn::IfThenElseZero(hn::Not(back), hn::Set(d, (kBrickSide - 1) * cell_step))),
                di, rays.last_cell[a] + i);
      hn::Store(hn::DemoteTo(di, hn::Min(distance, far)), di, rays.delta[a] + i);
    }
  }
}

std::uint32_t meet(const PacketRays& rays, const double lo[3], const double hi[3], double begin, double end,
                   BrickHits& hits) {
  const DoubleTag d;
  std::uint32_t met = 0;
  for (int i = 0; i < kRays; i += kHalf) {
    auto in = hn::Set(d, begin), out = hn::Set(d, end);
    hn::Vec<DoubleTag> far[3];
    for (int a = 0; a < 3; ++a) {
      const auto inverse = hn::Load(d, rays.inverse[a] + i);
      const auto t0 = hn::Mul(hn::Set(d, lo[a]), inverse), t1 = hn::Mul(hn::Set(d, hi[a]), inverse);
      in = hn::Max(in, hn::Min(t0, t1));
      far[a] = hn::Max(t0, t1);
      out = hn::Min(out, far[a]);
    }
    const auto meets = hn::Lt(in, out);
    if (hn::AllFalse(d, meets)) continue;
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, meets, bits);
    met |= static_cast<std::uint32_t>(bits[0]) << i;
    for (int a = 0; a < 3; ++a) hn::Store(hn::Sub(far[a], in), d, hits.to_exit[a] + i);
    hn::Store(hn::Sub(out, in), d, hits.length + i);
  }
  return met;
}

/// Where crossings begin, an axis.
struct alignas(64) Entry {
  std::int32_t next[kMaxPacketRays];    ///< of the plane at which the ray leaves its first cell
  std::int32_t planes[kMaxPacketRays];  ///< from there to the plane where the brick ends
  float cells[kMaxPacketRays];          ///< the same from the point of entry, with parts
};

HWY_INLINE void enter(const PacketRays& rays, const BrickCrossings& crossings, int axis, Entry& entry) {
  const DoubleTag d;
  const HalfIntTag di;
  const HalfFloatTag df;
  for (int i = 0; i < kRays; i += kHalf) {
    const auto to_exit = hn::Load(d, crossings.to_exit[axis] + i);
    const auto distance = hn::Load(d, rays.distance[axis] + i);
    const auto cells = hn::Mul(to_exit, hn::Load(d, rays.per_distance[axis] + i));
    const auto planes = hn::DemoteTo(di, hn::Min(cells, hn::Set(d, kBrickSide - 1.0)));
    const auto plane = hn::NegMulAdd(hn::PromoteTo(d, planes), distance, to_exit);
    hn::Store(hn::DemoteTo(di, hn::Min(plane, hn::Set(d, kPacketFar))), di, entry.next + i);
    hn::Store(planes, di, entry.planes + i);
    hn::Store(hn::DemoteTo(df, cells), df, entry.cells + i);
  }
}

/// From cell to cell: fills `cell`, `chord`, `count` and `to_centre`; returns the rows.
HWY_INLINE int walk_cells(const PacketRays& rays, BrickCrossings& crossings) {
  /// By how many units planes may be misplaced after eight additions of a rounded distance.
  constexpr std::int32_t kSlack = 16;
  const FloatTag df;
  const IntTag di;
  const auto zero = hn::Zero(di);
  IntVector next[3], delta[3], step[3], cell = zero;
  for (int a = 0; a < 3; ++a) {
    Entry entry;
    enter(rays, crossings, a, entry);
    next[a] = hn::Load(di, entry.next);
    delta[a] = hn::Load(di, rays.delta[a]);
    step[a] = hn::Load(di, rays.step[a]);
    const auto planes = hn::Load(di, entry.planes);
    cell = hn::Add(cell, hn::Sub(hn::Load(di, rays.last_cell[a]), hn::Mul(planes, step[a])));
    const auto place = hn::NegMulAdd(hn::Load(df, entry.cells), hn::Load(df, rays.sign[a]),
                                     hn::Load(df, rays.last_place[a]));
    hn::Store(hn::Sub(hn::Set(df, 0.5f), place), df, crossings.to_centre[a]);
  }
  const DoubleTag dd;
  const HalfIntTag half;
  alignas(64) std::int32_t ends_at[kMaxPacketRays];
  for (int i = 0; i < kRays; i += kHalf)
    hn::Store(hn::DemoteTo(half, hn::Load(dd, crossings.length + i)), half, ends_at + i);
  const auto end = hn::Load(di, ends_at);
  const auto before_last = hn::Sub(end, hn::Set(di, kSlack + 1));
  const auto in_brick = hn::Set(di, kBrickVoxels - 1);
  const auto unit = hn::Set(df, static_cast<float>(kPacketUnit));
  auto running = hn::Gt(end, zero);
  auto in = zero, count = zero;
  int rows = 0;
  while (rows < PacketSteps::kMaxRows && !hn::AllFalse(di, running)) {
    count = hn::Sub(count, hn::VecFromMask(di, running));
    const auto plane = hn::Min(hn::Min(next[0], next[1]), next[2]);
    const auto leaves = hn::Gt(plane, before_last);
    const auto out = hn::IfThenElse(leaves, end, hn::Max(plane, in));
    const auto chord = hn::Mul(hn::ConvertTo(df, hn::IfThenElseZero(running, hn::Sub(out, in))), unit);
    hn::Store(cell, di, crossings.cell[rows]);
    hn::Store(chord, df, crossings.chord[rows]);
    ++rows;
    running = hn::AndNot(leaves, running);
    in = out;
    for (int a = 0; a < 3; ++a) {
      const auto passed = hn::And(running, hn::Eq(next[a], plane));
      next[a] = hn::Add(next[a], hn::IfThenElseZero(passed, delta[a]));
      cell = hn::Add(cell, hn::IfThenElseZero(passed, step[a]));
    }
    // A plane that rounding puts before the end must not lead out of the brick.
    cell = hn::And(cell, in_brick);
  }
  hn::Store(count, di, crossings.count);
  return rows;
}

/// Tables of few bricks in registers: what a brick holds is permuted instead of being gathered from memory.
/// For vectors that hold all words of a brick.
struct FewBricks {
  static constexpr int kWords = kBrickVoxels / 32;
  static constexpr int kMost = kRays == kWords ? 4 : 0;

  int count = 0;  ///< 0: they are more than kMost, or there are none
  const Brick* brick[kMost + 1];
  std::uint32_t rays[kMost + 1] = {};  ///< bit `ray`: its crossing is in that brick
};

HWY_INLINE FewBricks few_bricks(const BrickCrossings& crossings) {
  FewBricks few;
  for (int ray = 0; ray < kRays && FewBricks::kMost > 0; ++ray) {
    if (crossings.count[ray] == 0) continue;
    int which = 0;
    few.brick[few.count] = crossings.brick[ray];
    while (few.brick[which] != crossings.brick[ray]) ++which;
    if (which == FewBricks::kMost) return {};
    few.rays[which] |= 1u << ray;
    few.count = std::max(few.count, which + 1);
  }
  return few;
}

/// Where each ray's brick is, in bytes from those of one of them.
struct alignas(64) BitTables {
  std::int32_t offset[kMaxPacketRays];
  const std::int32_t* base = nullptr;
  bool near = true;  ///< otherwise they are too far apart in memory for offsets
};

HWY_INLINE void find_tables(const BrickCrossings& crossings, BitTables& tables) {
  constexpr std::int64_t kFar = std::int64_t{1} << 30;
  const char* base = nullptr;
  for (int ray = 0; ray < kRays; ++ray) {
    tables.offset[ray] = 0;
    if (crossings.count[ray] == 0) continue;
    const char* const bits = reinterpret_cast<const char*>(crossings.brick[ray]);
    if (!base) base = bits;
    const std::int64_t offset = bits - base;
    tables.near &= offset > -kFar && offset < kFar;
    tables.offset[ray] = static_cast<std::int32_t>(offset);
  }
  tables.base = reinterpret_cast<const std::int32_t*>(base);
}

/// Keeps what exists: chord; `slot` gets the cell's word, which word_of(row, cells) finds, and `ray` ray + 16
/// cell.
template <class WordOf>
HWY_INLINE void keep_existing(const BrickCrossings& crossings, int rows, const WordOf& word_of,
                              PacketSteps& steps) {
  const FloatTag df;
  const IntTag di;
  const UnsignedTag du;
  const auto ray = hn::Iota(di, 0);
  const auto in_word = hn::Set(di, 31);
  const auto one = hn::Set(du, 1);
  int count = 0, kept_rows = 0;
  for (int row = 0; row < rows; ++row) {
    const auto cell = hn::Load(di, crossings.cell[row]);
    const auto word = hn::BitCast(du, word_of(row, cell));
    const auto chord = hn::Load(df, crossings.chord[row]);
    const auto bit = hn::And(hn::Shr(word, hn::BitCast(du, hn::And(cell, in_word))), one);
    const auto exists = hn::And(hn::RebindMask(df, hn::Eq(bit, one)), hn::Gt(chord, hn::Zero(df)));
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(df, exists, bits);
    const std::uint32_t kept = bits[0] | static_cast<std::uint32_t>(bits[1]) << 8;
    const auto code = hn::Add(ray, hn::ShiftLeft<4>(cell));
    hn::StoreU(hn::Compress(word, hn::RebindMask(du, exists)), du, steps.slot + count);
    hn::StoreU(hn::Compress(chord, exists), df, steps.length + count);
    hn::StoreU(hn::Compress(code, hn::RebindMask(di, exists)), di, steps.ray + count);
    count += __builtin_popcount(kept);
    steps.rays[kept_rows] = kept;
    kept_rows += kept != 0;
  }
  steps.count = count;
  steps.rows = kept_rows;
  hn::StoreU(hn::Zero(di), di, steps.ray + count);  // what is read behind the count is harmless
}

/// Slots from words: where the word's first voxel is, which first_of(ray, which word) finds, and how many of
/// the word come before.
template <class FirstOf>
HWY_INLINE void find_slots(const FirstOf& first_of, PacketSteps& steps) {
  const IntTag di;
  const UnsignedTag du;
  const auto lowest = hn::Set(di, kMaxPacketRays - 1), in_word = hn::Set(di, 31);
  const auto one = hn::Set(du, 1);
  for (int i = 0; i < steps.count; i += kRays) {
    const auto code = hn::LoadU(di, steps.ray + i);
    const auto cell = hn::And(hn::ShiftRight<4>(code), hn::Set(di, kBrickVoxels - 1));
    const auto below = hn::Sub(hn::Shl(one, hn::BitCast(du, hn::And(cell, in_word))), one);
    const auto rank = hn::PopulationCount(hn::And(hn::LoadU(du, steps.slot + i), below));
    const auto first = first_of(hn::IndicesFromVec(di, hn::And(code, lowest)), hn::ShiftRight<5>(cell));
    hn::StoreU(hn::BitCast(du, hn::Add(first, hn::BitCast(di, rank))), du, steps.slot + i);
  }
}

/// The existing voxels of crossings that share few bricks.
HWY_INLINE void look_up_few(const FewBricks& bricks, int rows, const BrickCrossings& crossings,
                            PacketSteps& steps) {
  constexpr int kMost = FewBricks::kMost + 1;
  const IntTag di;
  const hn::Rebind<std::uint16_t, IntTag> du16;
  const auto lane = hn::Shl(hn::Set(di, 1), hn::Iota(di, 0));
  IntVector words[kMost], first[kMost];
  hn::Mask<IntTag> rays[kMost];
  auto brick_of_ray = hn::Zero(di);
  for (int b = 0; b < bricks.count; ++b) {
    const Brick& brick = *bricks.brick[b];
    words[b] = hn::Load(di, reinterpret_cast<const std::int32_t*>(brick.word.data()));
    first[b] = hn::Add(hn::PromoteTo(di, hn::LoadU(du16, brick.before.data())),
                       hn::Set(di, static_cast<std::int32_t>(brick.first_slot)));
    rays[b] = hn::TestBit(hn::Set(di, static_cast<std::int32_t>(bricks.rays[b])), lane);
    brick_of_ray = hn::IfThenElse(rays[b], hn::Set(di, b), brick_of_ray);
  }
  const auto word_of = [&](int, const IntVector& cell) HWY_ATTR {
    const auto which = hn::IndicesFromVec(di, hn::ShiftRight<5>(cell));
    auto word = hn::TableLookupLanes(words[0], which);
    for (int b = 1; b < bricks.count; ++b)
      word = hn::IfThenElse(rays[b], hn::TableLookupLanes(words[b], which), word);
    return word;
  };
  keep_existing(crossings, rows, word_of, steps);
  find_slots(
      [&](auto ray, const IntVector& word) HWY_ATTR {
        const auto which = hn::IndicesFromVec(di, word);
        auto slot = hn::TableLookupLanes(first[0], which);
        if (bricks.count == 1) return slot;
        const auto brick = hn::TableLookupLanes(brick_of_ray, ray);
        for (int b = 1; b < bricks.count; ++b)
          slot = hn::IfThenElse(hn::Eq(brick, hn::Set(di, b)), hn::TableLookupLanes(first[b], which), slot);
        return slot;
      },
      steps);
}

/// The same of any crossings.
HWY_INLINE void look_up_any(int rows, BrickCrossings& crossings, PacketSteps& steps) {
  static_assert(offsetof(Brick, word) == 0);
  const IntTag di;
  BitTables tables;
  find_tables(crossings, tables);
  const auto first_slot = hn::Load(di, crossings.first_slot);
  if (tables.near) {
    const auto offset = hn::Load(di, tables.offset);
    keep_existing(
        crossings, rows,
        [&](int, const IntVector& cell) HWY_ATTR {
          return hn::GatherOffset(di, tables.base,
                                  hn::Add(offset, hn::ShiftLeft<2>(hn::ShiftRight<5>(cell))));
        },
        steps);
    // An entry is two bytes: it is read with the two before it.
    const auto before_offset = hn::Set(di, static_cast<std::int32_t>(offsetof(Brick, before)) - 2);
    find_slots(
        [&](auto ray, const IntVector& word) HWY_ATTR {
          const auto at =
              hn::Add(hn::Add(hn::TableLookupLanes(offset, ray), before_offset), hn::ShiftLeft<1>(word));
          const auto pair = hn::BitCast(UnsignedTag(), hn::GatherOffset(di, tables.base, at));
          return hn::Add(hn::TableLookupLanes(first_slot, ray), hn::BitCast(di, hn::ShiftRight<16>(pair)));
        },
        steps);
    return;
  }
  alignas(64) std::int32_t words[kMaxPacketRays];
  keep_existing(
      crossings, rows,
      [&](int row, const IntVector&) HWY_ATTR {
        for (int ray = 0; ray < kRays; ++ray)
          words[ray] =
              row < crossings.count[ray]
                  ? static_cast<std::int32_t>(crossings.brick[ray]->word[crossings.cell[row][ray] >> 5])
                  : 0;
        return hn::Load(di, words);
      },
      steps);
  find_slots([&](auto ray, const IntVector&) HWY_ATTR { return hn::TableLookupLanes(first_slot, ray); },
             steps);
  for (int i = 0; i < steps.count; ++i) {
    const int code = steps.ray[i];
    steps.slot[i] += crossings.brick[code & (kMaxPacketRays - 1)]->before[code >> 9];
  }
}

/// Ray weights, and rays alone in `ray`.
HWY_INLINE void weigh(const PacketRays& rays, const BrickCrossings& crossings, PacketSteps& steps) {
  const FloatTag df;
  const IntTag di;
  FloatVector unit[3], to_centre[3];
  for (int a = 0; a < 3; ++a) {
    unit[a] = hn::Load(df, rays.unit[a]);
    to_centre[a] = hn::Load(df, crossings.to_centre[a]);
  }
  const auto seven = hn::Set(di, 7), lowest = hn::Set(di, kMaxPacketRays - 1);
  const auto inverse_vertex_distance = hn::Set(df, 1.1547005383792515f);
  for (int i = 0; i < steps.count; i += kRays) {
    const auto code = hn::LoadU(di, steps.ray + i);
    const auto ray = hn::And(code, lowest);
    const auto which = hn::IndicesFromVec(df, ray);
    const auto of_ray = [&](const FloatVector& v) HWY_ATTR { return hn::TableLookupLanes(v, which); };
    const auto place = [&](auto cells, const FloatVector& offset) HWY_ATTR {
      return hn::Add(hn::ConvertTo(df, hn::And(cells, seven)), of_ray(offset));
    };
    const auto x = place(hn::ShiftRight<4>(code), to_centre[0]);
    const auto y = place(hn::ShiftRight<7>(code), to_centre[1]);
    const auto z = place(hn::ShiftRight<10>(code), to_centre[2]);
    const auto u = of_ray(unit[0]), v = of_ray(unit[1]), w = of_ray(unit[2]);
    const auto cx = hn::MulSub(y, w, hn::Mul(z, v));
    const auto cy = hn::MulSub(z, u, hn::Mul(x, w));
    const auto cz = hn::MulSub(x, v, hn::Mul(y, u));
    const auto squared = hn::MulAdd(cx, cx, hn::MulAdd(cy, cy, hn::Mul(cz, cz)));
    const auto weight = hn::NegMulAdd(hn::Sqrt(squared), inverse_vertex_distance, hn::Set(df, 1.0f));
    hn::StoreU(hn::Max(weight, hn::Zero(df)), df, steps.weight + i);
    hn::StoreU(ray, di, steps.ray + i);
  }
}

void walk(const PacketRays& rays, BrickCrossings& crossings, PacketSteps& steps) {
  const int rows = walk_cells(rays, crossings);
  const FewBricks bricks = few_bricks(crossings);
  if (bricks.count > 0)
    look_up_few(bricks, rows, crossings, steps);
  else
    look_up_any(rows, crossings, steps);
  if (steps.count == 0) return;
  const FloatTag df;
  const IntTag di;
  weigh(rays, crossings, steps);
  for (int i = steps.count; i < steps.count + kMaxPacketRays; i += kRays) {  // harmless, whoever reads on
    hn::StoreU(hn::Set(di, static_cast<std::int32_t>(steps.slot[0])), di,
               reinterpret_cast<std::int32_t*>(steps.slot) + i);
    hn::StoreU(hn::Zero(df), df, steps.length + i);
    hn::StoreU(hn::Zero(df), df, steps.weight + i);
    hn::StoreU(hn::Zero(di), di, steps.ray + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace roxel::internal
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace roxel::internal {

HWY_EXPORT(lanes);
HWY_EXPORT(prepare);
HWY_EXPORT(meet);
HWY_EXPORT(walk);

int packet_lanes() { return HWY_DYNAMIC_DISPATCH(lanes)(); }

void prepare_rays(PacketRays& rays) { HWY_DYNAMIC_DISPATCH(prepare)(rays); }

std::uint32_t meet_brick(const PacketRays& rays, const double lo[3], const double hi[3], double begin,
                         double end, BrickHits& hits) {
  return HWY_DYNAMIC_DISPATCH(meet)(rays, lo, hi, begin, end, hits);
}

void walk_crossings(const PacketRays& rays, BrickCrossings& crossings, PacketSteps& steps) {
  HWY_DYNAMIC_DISPATCH(walk)(rays, crossings, steps);
}

}  // namespace roxel::internal
#endif

#include "roxel/march/packet_walk.h"

#include <cstring>

#include "roxel/base/kernel.h"
#include "roxel/base/lanes.h"

namespace roxel {

namespace {

/// Positions beyond any brick's far side, which two of still fit an integer.
constexpr std::int32_t kFar = (1 << 30) - 1;
/// By how many units planes may be misplaced after eight additions of a rounded distance.
constexpr std::int32_t kSlack = 16;
/// From kWalkUnit to BrickCrossings::kUnit.
constexpr int kShift = 2;

/// Rows of lanes as one array.
template <class Element, std::size_t rows>
inline Element* flat(Element (&array)[rows][kLanes]) {
  return reinterpret_cast<Element*>(&array);
}

using Doubles = double __attribute__((vector_size(32)));
using FourInts = std::int32_t __attribute__((vector_size(16)));

/// Where eight crossings begin, an axis.
struct alignas(32) Entry {
  std::int32_t next[kLanes];    ///< of the plane at which the ray leaves its first cell, in kUnit
  std::int32_t planes[kLanes];  ///< from there to the plane where the brick ends
  float cells[kLanes];          ///< the same from the point of entry, with parts
};

inline __attribute__((always_inline)) void enter_bricks(const BrickCrossings& c, int axis, Entry& entry) {
#pragma GCC unroll 2
  for (int half = 0; half < kLanes; half += 4) {
    Doubles to_exit, distance, per_distance;
    load(c.to_exit[axis] + half, to_exit);
    load(c.distance[axis] + half, distance);
    load(c.per_distance[axis] + half, per_distance);
    const Doubles cells = to_exit * per_distance;
    const Doubles most = Doubles{} + (kBrickSide - 1.0), far = Doubles{} + kFar;
    const FourInts planes = __builtin_convertvector(cells < most ? cells : most, FourInts);
    // Whole numbers below 2^53: exact, so that the plane is where any other brick's ray finds it.
    const Doubles plane =
        (to_exit - __builtin_convertvector(planes, Doubles) * distance) * (1.0 / (1 << kShift));
    store(__builtin_convertvector(plane < far ? plane : far, FourInts), entry.next + half);
    store(planes, entry.planes + half);
    store(__builtin_convertvector(cells, FourFloats), entry.cells + half);
  }
}

ROXEL_KERNEL void walk_bricks(BrickCrossings& c) {
  constexpr float kInverseVertexDistance = 1.1547005383792515f;
  Ints next[3], delta[3], step[3], end, cell{}, in{}, count{};
  Floats to_centre[3], u[3];
#pragma GCC unroll 3
  for (int a = 0; a < 3; ++a) {
    Entry entry;
    enter_bricks(c, a, entry);
    Ints planes, last_cell;
    Floats cells, last_place, sign;
    load(entry.next, next[a]);
    load(entry.planes, planes);
    load(entry.cells, cells);
    load(c.delta[a], delta[a]);
    load(c.step[a], step[a]);
    load(c.direction[a], u[a]);
    load(c.last_cell[a], last_cell);
    load(c.last_place[a], last_place);
    load(c.sign[a], sign);
    cell += last_cell - planes * step[a];
    to_centre[a] = 0.5f - (last_place - cells * sign);
  }
  load(c.end, end);
  const Ints last = end - kSlack;
  Ints running = end > 0;
  int rows = 0;
  while (rows < BrickCrossings::kMaxCells) {
    count -= running;
    const Ints nearer = next[0] < next[1] ? next[0] : next[1];
    const Ints plane = nearer < next[2] ? nearer : next[2];
    const Ints ends = plane >= last;
    const Ints out = ends ? end : (plane > in ? plane : in);
    const Floats length =
        __builtin_convertvector(out - in, Floats) * static_cast<float>(BrickCrossings::kUnit);
    const Floats x = __builtin_convertvector(cell & 7, Floats) + to_centre[0];
    const Floats y = __builtin_convertvector((cell >> 3) & 7, Floats) + to_centre[1];
    const Floats z = __builtin_convertvector(cell >> 6, Floats) + to_centre[2];
    const Floats cx = y * u[2] - z * u[1], cy = z * u[0] - x * u[2], cz = x * u[1] - y * u[0];
    store(cell, c.cells[rows]);
    store(length, c.length[rows]);
    store(cx * cx + cy * cy + cz * cz, c.weight[rows]);  // made a weight of below
    ++rows;
    running &= ~ends;
    if (!any(running)) break;
    in = out;
#pragma GCC unroll 3
    for (int a = 0; a < 3; ++a) {
      const Ints passed = running & (next[a] == plane);
      next[a] += passed & delta[a];
      cell += passed & step[a];
    }
    cell &= kBrickVoxels - 1;  // a plane that rounding puts before the end must not lead out of the brick
  }
  store(count, c.count);
  float* const weights = flat(c.weight);
  const float* const lengths = flat(c.length);
  for (int i = 0; i < rows * kLanes; ++i) {
    const float weight = 1 - std::sqrt(weights[i]) * kInverseVertexDistance;
    weights[i] = weight > 0 && lengths[i] > 0 ? weight : 0.0f;
  }
}

}  // namespace

void BrickCrossings::walk() { walk_bricks(*this); }

PacketWalk::PacketWalk(const LatticeStack& stack) : stack_(stack) {
  std::memset(&crossings_, 0, sizeof crossings_);
}

void PacketWalk::begin(int lane, const Ray& ray, Stretch range, const Stretch* sight) {
  Lane& l = lanes_[lane];
  l.ray = ray;
  l.segments.clear();
  walk_lattices(stack_.boxes(), ray, range, sight, [&](int lattice, Stretch stretch) {
    l.segments.emplace_back(lattice, stretch);
    return true;
  });
  std::reverse(l.segments.begin(), l.segments.end());
  l.running = true;
  open_segment(lane);
}

/// Sets the lane up for its next stretch within one lattice, if there is any.
void PacketWalk::open_segment(int lane) {
  Lane& l = lanes_[lane];
  if (l.segments.empty()) {
    l.running = false;
    return;
  }
  constexpr double kAlong = 1 << 17;  // as in walk_cells
  const auto [lattice, range] = l.segments.back();
  l.segments.pop_back();
  const BrickIndex& index = stack_.volume().index(lattice);
  const LatticeFrame& frame = index.frame();
  const double inverse_size = 1 / frame.voxel_size;
  const double norm = l.ray.direction.norm() * inverse_size;
  const double inverse_norm = 1 / norm;
  const double scale = norm / kWalkUnit;
  l.lattice = lattice;
  l.table = index.table();
  l.bricks = index.bricks().data();
  l.in = static_cast<std::int64_t>(range.begin * scale);
  l.end = static_cast<std::int64_t>(range.end * scale);
  l.fresh = true;
  std::ptrdiff_t stride = 1;
  l.index = 0;
  BrickCrossings& c = crossings_;
  for (int a = 0; a < 3; ++a) {
    const double origin = (l.ray.origin[a] - frame.origin[a]) * inverse_size;
    const double direction = l.ray.direction[a] * inverse_size;
    const bool along = std::abs(direction) * kAlong < norm;
    const double per_cell = along ? 0 : scale / direction;
    const int bricks = frame.size_in_bricks[a];
    const internal::WalkAxis axis{static_cast<std::int64_t>(-origin * per_cell),
                                  static_cast<std::int64_t>(per_cell),
                                  along           ? 0
                                  : direction > 0 ? 1
                                                  : -1,
                                  bricks};
    const double entry = origin + range.begin * direction;
    // A cell off by rounding makes a crossing without length, or leaves out as little.
    const int cell = std::clamp(static_cast<int>(entry), 0, bricks * kBrickSide - 1);
    const int brick = cell / kBrickSide;
    l.leaves[a] = axis.leaves(brick * kBrickSide, kBrickSide);
    l.brick_distance[a] = kBrickSide * std::abs(axis.distance);
    l.stride[a] = stride * axis.step;
    l.ahead[a] = axis.step > 0 ? bricks - 1 - brick : brick;
    l.index += stride * brick;
    stride *= bricks;
    const std::int64_t distance = std::abs(axis.distance);
    c.distance[a][lane] = static_cast<double>(distance);
    c.per_distance[a][lane] = along ? 0 : 1 / static_cast<double>(distance);
    c.delta[a][lane] = static_cast<std::int32_t>(std::min<std::int64_t>(distance >> kShift, kFar));
    c.step[a][lane] = axis.step * (1 << 3 * a);
    c.direction[a][lane] = static_cast<float>(direction * inverse_norm);
    c.sign[a][lane] = static_cast<float>(axis.step);
    const int last_cell = along ? cell % kBrickSide : axis.step > 0 ? kBrickSide - 1 : 0;
    c.last_cell[a][lane] = last_cell * (1 << 3 * a);
    c.last_place[a][lane] = along           ? static_cast<float>(entry - brick * kBrickSide)
                            : axis.step > 0 ? kBrickSide
                                            : 0;
  }
}

/// Goes on to the next existing brick within the stretch; null where there is none.
const Brick* PacketWalk::search(Lane& l) {
  std::int64_t in = l.in;
  const std::int64_t end = l.end;
  std::ptrdiff_t index = l.index;
  bool fresh = l.fresh;
  while (true) {
    int axis = l.leaves[1] < l.leaves[0] ? 1 : 0;
    axis = l.leaves[2] < l.leaves[axis] ? 2 : axis;
    const std::int64_t out = l.leaves[axis];
    if (fresh) {
      const std::int32_t found = l.table[index];
      if (found >= 0 && std::min(out, end) > in) {
        l.in = in;
        l.index = index;
        l.fresh = false;
        return &l.bricks[found];
      }
    }
    if (out >= end || l.ahead[axis] == 0) return nullptr;
    in = std::max(in, out);
    l.leaves[axis] = out + l.brick_distance[axis];
    index += l.stride[axis];
    --l.ahead[axis];
    fresh = true;
  }
}

/// The next existing brick that the lane's ray crosses, its crossing set up; null where there is none.
const Brick* PacketWalk::find_brick(int lane) {
  Lane& l = lanes_[lane];
  while (l.running) {
    if (const Brick* brick = search(l)) {
      set_up_crossing(lane);
      return brick;
    }
    open_segment(lane);
  }
  return nullptr;
}

void PacketWalk::set_up_crossing(int lane) {
  const Lane& l = lanes_[lane];
  std::int64_t out = l.end;
  for (int a = 0; a < 3; ++a) {
    out = std::min(out, l.leaves[a]);
    crossings_.to_exit[a][lane] = static_cast<double>(l.leaves[a] - l.in);
  }
  crossings_.end[lane] = static_cast<std::int32_t>(std::max<std::int64_t>((out - l.in) >> kShift, 1));
}

/// Adds the existing ones among the cells that the lane's ray met.
void PacketWalk::append(int lane, const Brick& brick, StepRows& steps) const {
  const BrickCrossings& c = crossings_;
  const std::uint16_t* local = brick.local.data();
  const std::uint32_t first_slot = brick.first_slot;
  const std::ptrdiff_t cells = std::ptrdiff_t{kLanes} * c.count[lane];
  const std::ptrdiff_t first = std::ptrdiff_t{kLanes} * steps.count[lane];
  const std::int32_t* const cell = flat(c.cells);
  const float* const length = flat(c.length);
  const float* const weight = flat(c.weight);
  std::uint32_t* const slots = flat(steps.slot) + lane;
  float* const lengths = flat(steps.length) + lane;
  float* const weights = flat(steps.weight) + lane;
  std::ptrdiff_t to = first;
#pragma GCC unroll 4
  for (std::ptrdiff_t i = lane; i < lane + cells; i += kLanes) {
    // Written whether there is a voxel or not, counted if there is: no branch to mispredict.
    const std::uint32_t voxel = local[cell[i]];
    slots[to] = first_slot + voxel;
    lengths[to] = length[i];
    weights[to] = weight[i];
    to += voxel == kNoVoxel ? 0 : kLanes;
  }
  if (to == first) return;
  steps.begins[first / kLanes] |= static_cast<std::uint8_t>(1 << lane);
  steps.count[lane] = static_cast<int>(to / kLanes);
  const std::ptrdiff_t index = &brick - lanes_[lane].bricks;
  const auto number = stack_.first_brick(lanes_[lane].lattice) + static_cast<std::uint32_t>(index);
  if (steps.brick_count == 0 || steps.bricks[steps.brick_count - 1] != number)
    steps.bricks[steps.brick_count++] = number;
}

bool PacketWalk::next(StepRows& steps) {
  steps.brick_count = 0;
  std::fill(steps.count, steps.count + kLanes, 0);
  std::fill(steps.begins, steps.begins + StepRows::kMaxRows, 0);
  bool any = false;
  for (int round = 0; round < kBricksARound; ++round) {
    const Brick* met[kLanes];
    bool more = false;
    for (int lane = 0; lane < kLanes; ++lane) {
      met[lane] = find_brick(lane);
      more |= met[lane] != nullptr;
      if (!met[lane]) crossings_.end[lane] = 0;
    }
    if (!more) break;
    any = true;
    crossings_.walk();
    for (int lane = 0; lane < kLanes; ++lane)
      if (met[lane]) append(lane, *met[lane], steps);
  }
  pad(steps);
  return any;
}

void PacketWalk::pad(StepRows& steps) {
  const int* longest = std::max_element(steps.count, steps.count + kLanes);
  const std::ptrdiff_t source = longest - steps.count;
  steps.rows = *longest;
  for (int lane = 0; lane < kLanes; ++lane)
    for (int row = steps.count[lane]; row < steps.rows; ++row) {
      steps.slot[row][lane] = steps.slot[row][source];
      steps.length[row][lane] = steps.weight[row][lane] = 0;
    }
}

}  // namespace roxel

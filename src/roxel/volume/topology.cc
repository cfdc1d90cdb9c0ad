// The only file of this module that sees OpenVDB (by vdb_grids.inl). A leaf of the mask tree is a brick
// (8^3), so every edit works on whole masks. OpenVDB numbers the voxels of a leaf z fastest, roxel x fastest:
// masks are transposed on their way in and out. What changes the tree itself
// (new leaves) is done by one thread, which takes some 50 ns a leaf; all else by as many as there may be.
#include <algorithm>
#include <cmath>
#include <utility>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/volume/vdb_grids.inl"
#include "roxel/volume/volume.h"

namespace roxel {
namespace {

using openvdb::MaskTree;
using Leaf = MaskTree::LeafNodeType;
static_assert(Leaf::DIM == kBrickSide);

openvdb::Coord to_coord(const Eigen::Vector3i& ijk) { return {ijk.x(), ijk.y(), ijk.z()}; }

Eigen::Vector3i brick_of(const Leaf& leaf) {
  const openvdb::Coord& o = leaf.origin();
  return {o.x() / kBrickSide, o.y() / kBrickSide, o.z() / kBrickSide};
}

bool inside(const Eigen::Vector3i& ijk, const Eigen::Vector3i& size) {
  return (ijk.array() >= 0).all() && (ijk.array() < size.array()).all();
}

// A leaf's mask word by word: word x, bit 8 y + z.
using Words = std::array<std::uint64_t, kBrickSide>;

Words words_of(const Leaf& leaf) {
  Words words;
  for (int x = 0; x < kBrickSide; ++x) words[x] = leaf.getValueMask().getWord<std::uint64_t>(x);
  return words;
}

void set_words(const Words& words, Leaf& leaf) {
  Leaf::NodeMaskType mask;
  for (int x = 0; x < kBrickSide; ++x) mask.getWord<std::uint64_t>(x) = words[x];
  leaf.setValueMask(mask);
}

// The same voxels numbered the other way round, x and z for each other; its own inverse.
Words swapped(const Words& words) {
  Words other{};
  for (int y = 0; y < kBrickSide; ++y) {
    std::uint64_t rows = 0;  // byte x, bit z
    for (int x = 0; x < kBrickSide; ++x) rows |= (words[x] >> 8 * y & 0xff) << 8 * x;
    // A transposition of 8 x 8 bits: of 2 x 2, of 2 x 2 blocks of those, and so on.
    std::uint64_t moved = (rows ^ rows >> 7) & 0x00aa00aa00aa00aau;
    rows ^= moved ^ moved << 7;
    moved = (rows ^ rows >> 14) & 0x0000cccc0000ccccu;
    rows ^= moved ^ moved << 14;
    moved = (rows ^ rows >> 28) & 0x00000000f0f0f0f0u;
    rows ^= moved ^ moved << 28;
    for (int z = 0; z < kBrickSide; ++z) other[z] |= (rows >> 8 * z & 0xff) << 8 * y;
  }
  return other;
}

BrickMask mask_of(const Leaf& leaf) {
  const Words words = swapped(words_of(leaf));
  BrickMask mask;
  for (int z = kBrickSide - 1; z >= 0; --z) mask = mask << 64 | BrickMask(words[z]);
  return mask;
}

Words words_of(const BrickMask& mask) {
  const BrickMask low(~std::uint64_t{0});
  Words words;
  for (int z = 0; z < kBrickSide; ++z) words[z] = (mask >> 64 * z & low).to_ullong();
  return swapped(words);
}

Words either(const Words& a, const Words& b) {
  Words both;
  for (int x = 0; x < kBrickSide; ++x) both[x] = a[x] | b[x];
  return both;
}

bool any(const Words& words) {
  return std::any_of(words.begin(), words.end(), [](std::uint64_t word) { return word != 0; });
}

void add(const BrickMask& mask, Leaf& leaf) { set_words(either(words_of(leaf), words_of(mask)), leaf); }

constexpr std::uint64_t kFirstZ = 0x0101010101010101u, kLastZ = kFirstZ << 7;

// What voxels have that lie one step further back along the axis; `before` is the brick from which the first
// layer takes it.
Words moved_on(const Words& words, const Words& before, int axis) {
  Words moved;
  for (int x = 0; x < kBrickSide; ++x)
    moved[x] = axis == 0   ? (x > 0 ? words[x - 1] : before[kBrickSide - 1])
               : axis == 1 ? words[x] << 8 | before[x] >> 56
                           : (words[x] & ~kLastZ) << 1 | (before[x] & kLastZ) >> 7;
  return moved;
}

// The same the other way round.
Words moved_back(const Words& words, const Words& after, int axis) {
  Words moved;
  for (int x = 0; x < kBrickSide; ++x)
    moved[x] = axis == 0   ? (x + 1 < kBrickSide ? words[x + 1] : after[0])
               : axis == 1 ? words[x] >> 8 | after[x] << 56
                           : (words[x] & ~kFirstZ) >> 1 | (after[x] & kFirstZ) << 7;
  return moved;
}

// A brick's voxels, those of the bricks before and after it, and all that lie within `steps` <= 8 of them
// along the axis. What leaves the brick and comes back was there before.
Words spread(Words words, Words before, Words after, int axis, int steps) {
  constexpr Words kNone{};
  for (int step = 0; step < steps; ++step) {
    words = either(words, either(moved_on(words, before, axis), moved_back(words, after, axis)));
    before = either(before, moved_on(before, kNone, axis));
    after = either(after, moved_back(after, kNone, axis));
  }
  return words;
}

// Whether some voxel is within `steps` <= 8 of the next brick along the axis, or of the one before.
bool reaches_on(const Words& words, int axis, int steps) { return any(spread({}, words, {}, axis, steps)); }
bool reaches_back(const Words& words, int axis, int steps) { return any(spread({}, {}, words, axis, steps)); }

// The four bits of `four` twice each, twice side by side: two rows of the divided voxels.
std::uint64_t divided_row(std::uint64_t four) {
  const std::uint64_t twice = 3 * ((four & 1) | (four & 2) << 1 | (four & 4) << 2 | (four & 8) << 3);
  return twice | twice << 8;
}

// The voxels of one octant of a parent brick, each divided into eight: those of one child brick.
Words divided_octant(const Words& parent, int ox, int oy, int oz) {
  Words child;
  for (int x = 0; x < kBrickSide; ++x) {
    const std::uint64_t word = parent[4 * ox + x / 2] >> (8 * 4 * oy + 4 * oz);
    child[x] = 0;
    for (int y = 0; y < 4; ++y) child[x] |= divided_row(word >> 8 * y & 0xf) << 16 * y;
  }
  return child;
}

constexpr std::int64_t kLeavesAtOnce = 256;

// Calls body(index) for all indices in [0, count).
template <class Body>
void for_each_index(std::int64_t count, int threads, const Body& body) {
  parallel_for_blocks(count, kLeavesAtOnce, threads, [&](std::int64_t begin, std::int64_t end, int) {
    for (std::int64_t i = begin; i < end; ++i) body(i);
  });
}

}  // namespace

struct Topology::Tree {
  MaskTree::Ptr made = make_tree<openvdb::MaskGrid>();
  MaskTree& mask = *made;

  // All of them, also those whose voxels are gone. The tree holds no tiles.
  std::vector<Leaf*> leaves() {
    std::vector<Leaf*> all;
    all.reserve(mask.leafCount());
    mask.getNodes(all);
    return all;
  }
  std::vector<const Leaf*> leaves() const {
    std::vector<const Leaf*> all;
    all.reserve(mask.leafCount());
    std::as_const(mask).getNodes(all);
    return all;
  }
  const Leaf* leaf_at(const Eigen::Vector3i& brick) const {
    return mask.probeConstLeaf(to_coord(kBrickSide * brick));
  }
  void spread(const Eigen::Vector3i& size_in_bricks, int axis, int steps, int threads);
};

Topology::Topology(const LatticeFrame& frame) : frame_(frame), tree_(std::make_unique<Tree>()) {}
Topology::Topology(const Topology& other) : frame_(other.frame_), tree_(std::make_unique<Tree>()) {
  tree_->mask.topologyUnion(other.tree_->mask);
}
Topology::Topology(Topology&&) noexcept = default;
Topology& Topology::operator=(const Topology& other) { return *this = Topology(other); }
Topology& Topology::operator=(Topology&&) noexcept = default;
Topology::~Topology() = default;

std::int64_t Topology::voxel_count() const {
  std::int64_t count = 0;
  for (const Leaf* leaf : std::as_const(*tree_).leaves())
    count += static_cast<std::int64_t>(leaf->onVoxelCount());
  return count;
}

bool Topology::contains(const Eigen::Vector3i& ijk) const { return tree_->mask.isValueOn(to_coord(ijk)); }

void Topology::insert(const Eigen::Vector3i& ijk) {
  if (inside(ijk, frame_.size_in_voxels())) tree_->mask.touchLeaf(to_coord(ijk))->setValueOn(to_coord(ijk));
}

void Topology::insert_brick(const Eigen::Vector3i& brick, const BrickMask& mask) {
  if (mask.none() || !inside(brick, frame_.size_in_bricks)) return;
  Leaf* leaf = tree_->mask.touchLeaf(to_coord(kBrickSide * brick));
  add(mask, *leaf);
}

void Topology::erase_brick(const Eigen::Vector3i& brick, const BrickMask& mask) {
  Leaf* leaf = tree_->mask.probeLeaf(to_coord(kBrickSide * brick));
  if (!leaf) return;
  const Words erased = words_of(mask);
  Words words = words_of(*leaf);
  for (int x = 0; x < kBrickSide; ++x) words[x] &= ~erased[x];
  set_words(words, *leaf);
}

void Topology::insert_bricks(std::span<const BrickVoxels> bricks, int threads) {
  std::vector<Leaf*> leaves(bricks.size(), nullptr);
  for (std::size_t b = 0; b < bricks.size(); ++b)
    if (bricks[b].mask.any() && inside(bricks[b].brick, frame_.size_in_bricks))
      leaves[b] = tree_->mask.touchLeaf(to_coord(kBrickSide * bricks[b].brick));
  for_each_index(bricks.size(), threads, [&](std::int64_t b) {
    if (leaves[b]) add(bricks[b].mask, *leaves[b]);
  });
}

// Adds what lies within `steps` <= 8 along the axis, in two steps: first the leaves that some leaf reaches,
// then all masks anew from those before.
void Topology::Tree::spread(const Eigen::Vector3i& size_in_bricks, int axis, int steps, int threads) {
  const Eigen::Vector3i next = Eigen::Vector3i::Unit(axis);
  const std::vector<Leaf*> sources = leaves();
  std::vector<std::uint8_t> reached(sources.size(), 0);  // bit 0: the brick before; bit 1: that after
  for_each_index(sources.size(), threads, [&](std::int64_t i) {
    const Eigen::Vector3i brick = brick_of(*sources[i]);
    const Words words = words_of(*sources[i]);
    if (brick[axis] > 0 && reaches_back(words, axis, steps) && !leaf_at(brick - next)) reached[i] |= 1;
    if (brick[axis] + 1 < size_in_bricks[axis] && reaches_on(words, axis, steps) && !leaf_at(brick + next))
      reached[i] |= 2;
  });
  for (std::size_t i = 0; i < sources.size(); ++i)
    for (int side = 0; side < 2; ++side)
      if (reached[i] >> side & 1)
        mask.touchLeaf(to_coord(kBrickSide * (brick_of(*sources[i]) + (2 * side - 1) * next)));

  const std::vector<Leaf*> targets = leaves();
  std::vector<Words> wider(targets.size());
  for_each_index(targets.size(), threads, [&](std::int64_t i) {
    const auto neighbour = [&](const Eigen::Vector3i& brick) {
      const Leaf* leaf = leaf_at(brick);
      return leaf ? words_of(*leaf) : Words{};
    };
    const Eigen::Vector3i brick = brick_of(*targets[i]);
    wider[i] =
        roxel::spread(words_of(*targets[i]), neighbour(brick - next), neighbour(brick + next), axis, steps);
  });
  for_each_index(targets.size(), threads, [&](std::int64_t i) { set_words(wider[i], *targets[i]); });
}

void Topology::dilate(int voxels, int threads) {
  // A cube is the sum of its three sides. The shortest way between two voxels of a box stays in the box, so
  // nothing outside is ever needed.
  for (; voxels > 0; voxels -= kBrickSide)
    for (int axis = 0; axis < 3; ++axis)
      tree_->spread(frame_.size_in_bricks, axis, std::min(voxels, kBrickSide), threads);
}

void Topology::erase_inside(const Eigen::AlignedBox3d& box, int threads) {
  if (box.isEmpty()) return;
  const auto in_voxels = [&](const Eigen::Vector3d& x) -> Eigen::Vector3d {
    return (x - frame_.origin) / frame_.voxel_size - Eigen::Vector3d::Constant(0.5);
  };
  // Clamp to the lattice before the conversion to int: a box may be far larger.
  const Eigen::Vector3d last = (frame_.size_in_voxels().array() - 1).cast<double>();
  const Eigen::Vector3i lo = in_voxels(box.min()).array().ceil().max(0.0).min(last.array() + 1).cast<int>();
  const Eigen::Vector3i hi = in_voxels(box.max()).array().floor().max(-1.0).min(last.array()).cast<int>();
  if ((lo.array() > hi.array()).any()) return;
  const openvdb::CoordBBox range(to_coord(lo), to_coord(hi));
  const std::vector<Leaf*> leaves = tree_->leaves();
  for_each_index(leaves.size(), threads, [&](std::int64_t i) {
    openvdb::CoordBBox part = leaves[i]->getNodeBoundingBox();
    part.intersect(range);
    if (part.empty()) return;
    for (auto ijk = part.begin(); ijk; ++ijk) leaves[i]->setValueOff(*ijk);
  });
}

Topology Topology::subdivided(int threads) const {
  LatticeFrame half = frame_;
  half.voxel_size /= 2;
  half.size_in_bricks *= 2;
  Topology result(half);
  const std::vector<const Leaf*> parents = std::as_const(*tree_).leaves();
  std::vector<std::array<std::unique_ptr<Leaf>, 8>> children(parents.size());
  for_each_index(parents.size(), threads, [&](std::int64_t i) {
    const Words parent = words_of(*parents[i]);
    for (int octant = 0; octant < 8; ++octant) {
      const Eigen::Vector3i o(octant & 1, (octant >> 1) & 1, octant >> 2);
      const Words words = divided_octant(parent, o.x(), o.y(), o.z());
      if (!any(words)) continue;
      children[i][octant] = std::make_unique<Leaf>(to_coord(kBrickSide * (2 * brick_of(*parents[i]) + o)));
      set_words(words, *children[i][octant]);
    }
  });
  for (std::array<std::unique_ptr<Leaf>, 8>& eight : children)
    for (std::unique_ptr<Leaf>& child : eight)
      if (child) result.tree_->mask.addLeaf(child.release());
  return result;
}

std::vector<BrickVoxels> Topology::bricks(int threads) const {
  std::vector<const Leaf*> leaves = std::as_const(*tree_).leaves();
  std::erase_if(leaves, [](const Leaf* leaf) { return leaf->isEmpty(); });
  std::sort(leaves.begin(), leaves.end(), [](const Leaf* a, const Leaf* b) {
    const openvdb::Coord &p = a->origin(), &q = b->origin();
    return std::array{p.z(), p.y(), p.x()} < std::array{q.z(), q.y(), q.x()};
  });
  std::vector<BrickVoxels> bricks(leaves.size());
  for_each_index(leaves.size(), threads, [&](std::int64_t i) {
    bricks[i] = {brick_of(*leaves[i]), mask_of(*leaves[i])};
  });
  return bricks;
}

void Topology::for_each_brick(
    const std::function<void(const Eigen::Vector3i&, const BrickMask&)>& visit) const {
  for (const BrickVoxels& brick : bricks()) visit(brick.brick, brick.mask);
}

}  // namespace roxel

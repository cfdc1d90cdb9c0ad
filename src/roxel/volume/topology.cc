// The only file of this module that sees OpenVDB (by vdb_grids.inl). A leaf of the mask tree is a brick
// (8^3), so every edit works on whole masks. OpenVDB numbers the voxels of a leaf z fastest, roxel x fastest:
// masks are transposed on their way in and out, bit by bit, over set bits only.
#include <openvdb/tools/Morphology.h>

#include <algorithm>
#include <cmath>

#include "roxel/base/error.h"
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

// Same voxel in OpenVDB's numbering (z fastest) and ours (x fastest): the map is its own inverse.
int swap_order(int n) { return (n >> 6) | (n & 0x38) | ((n & 7) << 6); }

BrickMask mask_of(const Leaf& leaf) {
  BrickMask mask;
  for (auto it = leaf.getValueMask().beginOn(); it; ++it) mask.set(swap_order(static_cast<int>(it.pos())));
  return mask;
}

template <class Visit>
void for_each_set(const BrickMask& mask, Visit visit) {
  for (auto v = mask._Find_first(); v < mask.size(); v = mask._Find_next(v)) visit(static_cast<int>(v));
}

bool inside(const Eigen::Vector3i& ijk, const Eigen::Vector3i& size) {
  return (ijk.array() >= 0).all() && (ijk.array() < size.array()).all();
}

// The voxels of one octant of a parent brick, each divided into eight: the mask of one child brick.
BrickMask divided_octant(const BrickMask& parent, int ox, int oy, int oz) {
  BrickMask child;
  for (int k = 0; k < kBrickSide; ++k)
    for (int j = 0; j < kBrickSide; ++j)
      for (int i = 0; i < kBrickSide; ++i)
        child[voxel_in_brick(i, j, k)] =
            parent[voxel_in_brick(4 * ox + i / 2, 4 * oy + j / 2, 4 * oz + k / 2)];
  return child;
}

}  // namespace

struct Topology::Tree {
  MaskTree::Ptr made = make_tree<openvdb::MaskGrid>();
  MaskTree& mask = *made;
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
  return static_cast<std::int64_t>(tree_->mask.activeVoxelCount());
}

bool Topology::contains(const Eigen::Vector3i& ijk) const { return tree_->mask.isValueOn(to_coord(ijk)); }

void Topology::insert(const Eigen::Vector3i& ijk) {
  if (inside(ijk, frame_.size_in_voxels())) tree_->mask.touchLeaf(to_coord(ijk))->setValueOn(to_coord(ijk));
}

void Topology::insert_brick(const Eigen::Vector3i& brick, const BrickMask& mask) {
  if (mask.none() || !inside(brick, frame_.size_in_bricks)) return;
  Leaf* leaf = tree_->mask.touchLeaf(to_coord(kBrickSide * brick));
  for_each_set(mask, [&](int v) { leaf->setValueOn(swap_order(v)); });
}

void Topology::erase_brick(const Eigen::Vector3i& brick, const BrickMask& mask) {
  Leaf* leaf = tree_->mask.probeLeaf(to_coord(kBrickSide * brick));
  if (leaf) for_each_set(mask, [&](int v) { leaf->setValueOff(swap_order(v)); });
}

void Topology::dilate(int voxels) {
  if (voxels <= 0) return;
  MaskTree& mask = tree_->mask;
  openvdb::tools::dilateActiveValues(mask, voxels, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::EXPAND_TILES);
  // The shortest way between two voxels of a box stays in the box, so clipping afterwards is enough.
  mask.clip(openvdb::CoordBBox(openvdb::Coord(0), to_coord(frame_.size_in_voxels()).offsetBy(-1)));
  mask.voxelizeActiveTiles();
}

void Topology::erase_inside(const Eigen::AlignedBox3d& box) {
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
  for (auto leaf = tree_->mask.beginLeaf(); leaf; ++leaf) {
    openvdb::CoordBBox part = leaf->getNodeBoundingBox();
    part.intersect(range);
    if (part.empty()) continue;
    for (auto ijk = part.begin(); ijk; ++ijk) leaf->setValueOff(*ijk);
  }
}

Topology Topology::subdivided() const {
  LatticeFrame half = frame_;
  half.voxel_size /= 2;
  half.size_in_bricks *= 2;
  Topology result(half);
  for (auto leaf = tree_->mask.cbeginLeaf(); leaf; ++leaf) {
    const BrickMask parent = mask_of(*leaf);
    for (int octant = 0; octant < 8; ++octant) {
      const Eigen::Vector3i o(octant & 1, (octant >> 1) & 1, octant >> 2);
      result.insert_brick(2 * brick_of(*leaf) + o, divided_octant(parent, o.x(), o.y(), o.z()));
    }
  }
  return result;
}

void Topology::for_each_brick(
    const std::function<void(const Eigen::Vector3i&, const BrickMask&)>& visit) const {
  std::vector<const Leaf*> leaves;
  leaves.reserve(tree_->mask.leafCount());
  for (auto leaf = tree_->mask.cbeginLeaf(); leaf; ++leaf)
    if (!leaf->isEmpty()) leaves.push_back(&*leaf);
  std::sort(leaves.begin(), leaves.end(), [](const Leaf* a, const Leaf* b) {
    const openvdb::Coord &p = a->origin(), &q = b->origin();
    return std::array{p.z(), p.y(), p.x()} < std::array{q.z(), q.y(), q.x()};
  });
  for (const Leaf* leaf : leaves) visit(brick_of(*leaf), mask_of(*leaf));
}

}  // namespace roxel

#include "roxel/volume/refine.h"

#include <algorithm>

#include "roxel/base/parallel.h"

namespace roxel {
namespace {

// For every brick of a lattice, the voxels that pass both thresholds.
std::vector<BrickMask> kept_masks(const Volume& volume, int lattice, const RefineOptions& options,
                                  int threads) {
  const std::vector<Brick>& bricks = volume.index(lattice).bricks();
  std::vector<BrickMask> masks(bricks.size());
  parallel_for_blocks(bricks.size(), 64, threads, [&](std::int64_t begin, std::int64_t end, int) {
    for (std::int64_t b = begin; b < end; ++b)
      bricks[b].for_each_voxel([&](int v, std::uint32_t slot) {
        masks[b][v] = alpha_from_tau(volume.tau[slot]) >= options.opacity_threshold &&
                      volume.confidence[slot] >= options.confidence_threshold;
      });
  });
  return masks;
}

Topology next_topology(const Volume& volume, int lattice, const std::vector<BrickMask>& kept,
                       const RefineOptions& options, int threads) {
  const BrickIndex& index = volume.index(lattice);
  std::vector<BrickVoxels> bricks(kept.size());
  for (std::size_t b = 0; b < kept.size(); ++b) bricks[b] = {index.bricks()[b].coord, kept[b]};
  Topology next(index.frame());
  next.insert_bricks(bricks, threads);
  next.dilate(options.dilate_voxels, threads);
  if (lattice > 0) next.erase_inside(volume.index(lattice - 1).frame().box(), threads);
  return options.subdivide ? next.subdivided(threads) : next;
}

// The channels of one lattice of the new volume, from the old one.
class Inheritance {
 public:
  Inheritance(const Volume& parent, const RefineOptions& options, Volume& child)
      : parent_(parent),
        child_(child),
        shift_(options.subdivide ? 1 : 0),
        prior_tau_(tau_from_alpha(options.prior_opacity)) {}

  void fill_brick(int lattice, const std::vector<BrickMask>& kept, const Brick& brick) const {
    brick.for_each_voxel(
        [&](int v, std::uint32_t slot) { fill(parent_slot(lattice, kept, voxel_of(brick, v)), slot); });
  }

 private:
  // The slot of the kept voxel that voxel `ijk` comes from, or kNoSlot.
  std::uint32_t parent_slot(int lattice, const std::vector<BrickMask>& kept,
                            const Eigen::Vector3i& ijk) const {
    const int x = ijk.x() >> shift_, y = ijk.y() >> shift_, z = ijk.z() >> shift_;
    const BrickIndex& index = parent_.index(lattice);
    const std::int32_t b = index.brick_at(x / kBrickSide, y / kBrickSide, z / kBrickSide);
    if (b < 0) return kNoSlot;
    const int v = voxel_in_brick(x % kBrickSide, y % kBrickSide, z % kBrickSide);
    return kept[b][v] ? index.bricks()[b].slot(v) : kNoSlot;
  }

  void fill(std::uint32_t from, std::uint32_t to) const {
    if (from == kNoSlot) {
      child_.tau[to] = prior_tau_;
      return;
    }
    child_.confidence[to] = parent_.confidence[from];
    child_.color_weight[to] = parent_.color_weight[from];
    child_.color_mean[to] = parent_.color_mean[from];
    child_.color_cov[to] = parent_.color_cov[from];
    child_.tau[to] = shift_ ? std::max(parent_.tau[from] / 2, prior_tau_) : parent_.tau[from];
    if (!shift_) child_.support[to] = parent_.support[from];
  }

  const Volume& parent_;
  Volume& child_;
  const int shift_;
  const float prior_tau_;
};

}  // namespace

Volume refine(const Volume& volume, const RefineOptions& options, int threads) {
  std::vector<std::vector<BrickMask>> kept;
  std::vector<Topology> lattices;
  for (int k = 0; k < volume.lattice_count(); ++k) {
    kept.push_back(kept_masks(volume, k, options, threads));
    lattices.push_back(next_topology(volume, k, kept.back(), options, threads));
  }
  Volume next(std::move(lattices), threads);
  const Inheritance inherit(volume, options, next);
  for (int k = 0; k < next.lattice_count(); ++k) {
    const std::vector<Brick>& bricks = next.index(k).bricks();
    parallel_for_blocks(bricks.size(), 64, threads, [&](std::int64_t begin, std::int64_t end, int) {
      for (std::int64_t b = begin; b < end; ++b) inherit.fill_brick(k, kept[k], bricks[b]);
    });
  }
  return next;
}

}  // namespace roxel

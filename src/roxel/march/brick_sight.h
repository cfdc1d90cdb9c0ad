#pragma once
/// Where a camera's rays can meet bricks at all: lets a walk begin at the first and end at the last of them.

#include <vector>

#include "roxel/march/ray_walk.h"

namespace roxel {

/// For square tiles of an image, and for each lattice: between which depths the rays through the tile can
/// meet existing bricks. Conservative: a walk cut to these stretches meets the same voxels.
class BrickSight {
 public:
  static constexpr int kTileSide = 16;  ///< pixels

  BrickSight(const LatticeStack& stack, const PinholeCamera& camera);

  /// One stretch a lattice, empty where there are no bricks, for the ray through pixel position (u, v), which
  /// must be inside the image (0 <= u <= width, 0 <= v <= height).
  const Stretch* at(double u, double v) const {
    const int x = std::min(static_cast<int>(u) / kTileSide, columns_ - 1);
    const int y = std::min(static_cast<int>(v) / kTileSide, rows_ - 1);
    return &stretches_[static_cast<std::size_t>(y * columns_ + x) * lattices_];
  }
  /// The same, or null where the ray through (u, v) cannot meet anything within `range`.
  const Stretch* within(double u, double v, Stretch range) const {
    const Stretch* stretch = at(u, v);
    const bool any = std::any_of(stretch, stretch + lattices_, [&](const Stretch& s) {
      return std::min(s.end, range.end) > std::max(s.begin, range.begin);
    });
    return any ? stretch : nullptr;
  }

 private:
  void add_lattice(const BrickIndex& index, int lattice, const PinholeCamera& camera);

  int columns_, rows_, lattices_;
  std::vector<Stretch> stretches_;  ///< tile after tile, lattice after lattice
};

}  // namespace roxel

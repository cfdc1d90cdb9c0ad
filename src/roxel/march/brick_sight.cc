#include "roxel/march/brick_sight.h"

#include "roxel/march/brick_outline.h"

namespace roxel {

namespace {

constexpr Stretch kNothing{std::numeric_limits<double>::infinity(), 0};

}  // namespace

BrickSight::BrickSight(const LatticeStack& stack, const PinholeCamera& camera)
    : columns_((camera.intrinsics.width + kTileSide - 1) / kTileSide),
      rows_((camera.intrinsics.height + kTileSide - 1) / kTileSide),
      lattices_(stack.volume().lattice_count()),
      stretches_(static_cast<std::size_t>(columns_) * rows_ * lattices_, kNothing) {
  for (int k = 0; k < lattices_; ++k) add_lattice(stack.volume().index(k), k, camera);
}

void BrickSight::add_lattice(const BrickIndex& index, int lattice, const PinholeCamera& camera) {
  constexpr double kDepth = BrickProjection::kMarginDepth;
  const BrickProjection projection(index.frame(), camera);
  for (const Brick& brick : index.bricks()) {
    const BrickOutline outline = projection.outline(brick.coord);
    if (outline.depth.end <= 0) continue;
    const auto [x0, x1] = BrickProjection::tiles(outline.u0, outline.u1, kTileSide, columns_);
    const auto [y0, y1] = BrickProjection::tiles(outline.v0, outline.v1, kTileSide, rows_);
    const Stretch depth{outline.depth.begin * (1 - kDepth), outline.depth.end * (1 + kDepth)};
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) {
        Stretch& tile = stretches_[static_cast<std::size_t>(y * columns_ + x) * lattices_ + lattice];
        tile = {std::min(tile.begin, depth.begin), std::max(tile.end, depth.end)};
      }
  }
}

}  // namespace roxel

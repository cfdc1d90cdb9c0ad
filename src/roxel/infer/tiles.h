#pragma once
/// The order in which marches take a node's root samples.

#include <Eigen/LU>

#include "roxel/base/run_context.h"
#include "roxel/infer/sample_view.h"
#include "roxel/march/brick_lists.h"
#include "roxel/march/brick_sight.h"

namespace roxel {

/// A view under way, with where its rays can meet anything.
struct ViewInSight {
  const SampleView& view;
  BrickSight sight;

  ViewInSight(const LatticeStack& stack, const SampleView& of) : view(of), sight(stack, of.camera) {}
};

/// A view under way, with the bricks that its samples' rays can meet.
struct ListedView {
  const SampleView& view;
  BrickLists lists;
  Eigen::Matrix3d direction_from_pixel;  ///< of (u, v, 1): PinholeCamera::ray

  ListedView(const LatticeStack& stack, const SampleView& of)
      : view(of),
        lists(stack, of.camera, of.plan),
        direction_from_pixel(of.camera.pose.rotation.transpose() * of.camera.intrinsics.matrix().inverse()) {}
};

/// Root samples [x0, x1) x [y0, y1) of a view: so few that what a march keeps of them stays in the cache
/// nearest to the processor.
struct Tile {
  static constexpr int kSide = BrickLists::kSide;
  int x0, x1, y0, y1;
};

/// Calls visit(prepared view, tile) for the node's views tile by tile, in a fixed order: block by block of
/// tiles, so that the voxels of neighbouring rays are still in a cache.
template <class Prepared, class Visit>
void for_each_tile(const LatticeStack& stack, const SampleNode& node, const RunContext& context,
                   Visit&& visit) {
  constexpr int kBlock = 4 * Tile::kSide;
  for (const SampleView& view : node) {
    const Prepared prepared(stack, view);
    const int level = view.plan.root_level;
    const int width = view.pyramid->width(level), height = view.pyramid->height(level);
    for (int block_y = 0; block_y < height; block_y += kBlock)
      for (int block_x = 0; block_x < width; block_x += kBlock) {
        context.throw_if_cancelled();
        for (int y = block_y; y < std::min(block_y + kBlock, height); y += Tile::kSide)
          for (int x = block_x; x < std::min(block_x + kBlock, width); x += Tile::kSide) {
            for (int row = y; row < std::min(y + Tile::kSide, height); ++row)  // of the next tile
              view.pyramid->prefetch(level, x + Tile::kSide, row);
            visit(prepared, Tile{x, std::min(x + Tile::kSide, width), y, std::min(y + Tile::kSide, height)});
          }
      }
  }
}

/// The same root by root: visit(view in sight, region).
template <class Visit>
void for_each_root(const LatticeStack& stack, const SampleNode& node, const RunContext& context,
                   Visit&& visit) {
  for_each_tile<ViewInSight>(stack, node, context, [&](const ViewInSight& in_sight, const Tile& tile) {
    for (int y = tile.y0; y < tile.y1; ++y)
      for (int x = tile.x0; x < tile.x1; ++x) visit(in_sight, Region{in_sight.view.plan.root_level, x, y});
  });
}

}  // namespace roxel

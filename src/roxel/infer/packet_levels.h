#pragma once
/// How the packet marches take a tile: its root samples and what they divide into, level by level, so that
/// the samples of a packet are neighbours of one size.

#include <algorithm>
#include <span>
#include <vector>

#include "roxel/infer/sample_view.h"
#include "roxel/infer/tiles.h"
#include "roxel/march/packet_walk.h"

namespace roxel {

/// The samples of one pyramid level that are marched together: indices into the samples.
struct SamplePacket {
  int count = 0;
  int sample[kMaxPacketRays];
};

/// Marches a tile's samples. What `March` has:
/// - samples(), each with its `region`;
/// - add(view, region, parent): appends a sample where there is one; a parent below 0 makes it a root;
/// - begin(origin, range, bricks) and add_ray(ray, direction) as PacketWalk, then march(view, packet);
/// - divides(view, sample, last): whether anything behind the sample matters;
/// - divided(sample, first_child, end_child): once its children are added;
/// - nothing_behind(view, sample): instead, where the children could not meet anything;
/// - level_done(end_sample): once all of a level are marched and divided.
template <class March>
void march_tile(March& march, const ListedView& listed, const Tile& tile) {
  const SampleView& view = listed.view;
  constexpr int kNoParent = -1;
  // Square blocks, or nearly, make packets of close neighbours.
  constexpr int kBlock = 4;
  const int rows = std::max(PacketWalk::rays() / kBlock, 1);
  for (int y = tile.y0; y < tile.y1; y += rows)
    for (int x = tile.x0; x < tile.x1; x += kBlock)
      for (int i = 0; i < kBlock * rows; ++i)
        if (x + i % kBlock < tile.x1 && y + i / kBlock < tile.y1)
          march.add(view, {view.plan.root_level, x + i % kBlock, y + i / kBlock}, kNoParent);

  const auto march_level = [&](int level, std::size_t first, std::size_t end, Stretch range) {
    if (range.end <= range.begin) return;
    SamplePacket packet;
    std::span<const std::uint32_t> bricks;
    const auto flush = [&] {
      if (packet.count > 0) march.march(view, packet);
      packet.count = 0;
    };
    for (std::size_t i = first; i < end; ++i) {
      const Region& region = march.samples()[i].region;
      const std::span<const std::uint32_t> here = listed.lists.at(level, region.x, region.y);
      if (here.empty()) continue;
      if (here.data() != bricks.data()) flush();
      if (packet.count == 0) {
        bricks = here;
        march.begin(view.camera.pose.centre, range, bricks);
      }
      const Eigen::Vector2d at = region_centre(view, region);
      march.add_ray(packet.count, listed.direction_from_pixel * Eigen::Vector3d(at.x(), at.y(), 1));
      packet.sample[packet.count++] = static_cast<int>(i);
      if (packet.count == PacketWalk::rays()) flush();
    }
    flush();
  };

  double begin = view.plan.range.begin;
  std::size_t first = 0;
  for (int level = view.plan.root_level; first < march.samples().size(); --level) {
    const Stretch range = served_range(view, {level, 0, 0}, begin);
    const std::size_t end = march.samples().size();
    march_level(level, first, end, range);
    const bool last = range.end >= view.plan.range.end || level == view.plan.finest_level;
    for (std::size_t i = first; i < end; ++i) {
      if (!march.divides(view, i, last)) continue;
      const Region region = march.samples()[i].region;
      if (const Region child = region.child(0); listed.lists.none_from(child.level, child.x, child.y)) {
        march.nothing_behind(view, i);
        continue;
      }
      const std::size_t first_child = march.samples().size();
      for (int c = 0; c < 4; ++c)
        if (const Region child = region.child(c); inside(view, child))
          march.add(view, child, static_cast<int>(i));
      march.divided(i, first_child, march.samples().size());
    }
    march.level_done(end);
    begin = std::max(range.begin, range.end);
    first = end;
  }
}

}  // namespace roxel

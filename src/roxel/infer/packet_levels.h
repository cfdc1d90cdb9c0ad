#pragma once
/// How the packet marches take a tile: its root samples and what they divide into, level by level, so that
/// the eight samples of a packet are neighbours of one size.

#include <vector>

#include "roxel/infer/sample_view.h"
#include "roxel/infer/tiles.h"
#include "roxel/march/packet_walk.h"

namespace roxel {

/// The samples of one pyramid level that are marched together: indices into the samples.
struct SamplePacket {
  int count = 0;
  int sample[kLanes];
};

/// Marches a tile's samples. What `March` has:
/// - samples(), each with its `region`;
/// - add(view, region, parent): appends a sample where there is one; a parent below 0 makes it a root;
/// - begin(lane, ray, range, sight), eight times at most, then march(view, packet): the rays begun;
/// - divides(view, sample, last): whether anything behind the sample matters;
/// - divided(sample, first_child, end_child): once its children are added;
/// - level_done(end_sample): once all of a level are marched and divided.
template <class March>
void march_tile(March& march, const ViewInSight& in_sight, const Tile& tile) {
  const SampleView& view = in_sight.view;
  constexpr int kNoParent = -1;
  // Blocks of 4 x 2 make packets of close neighbours.
  for (int y = tile.y0; y < tile.y1; y += 2)
    for (int x = tile.x0; x < tile.x1; x += 4)
      for (int i = 0; i < kLanes; ++i)
        if (x + i % 4 < tile.x1 && y + i / 4 < tile.y1)
          march.add(view, {view.plan.root_level, x + i % 4, y + i / 4}, kNoParent);

  const auto march_level = [&](std::size_t first, std::size_t end, Stretch range) {
    if (range.end <= range.begin) return;
    SamplePacket packet;
    const auto flush = [&] {
      if (packet.count > 0) march.march(view, packet);
      packet.count = 0;
    };
    for (std::size_t i = first; i < end; ++i) {
      const Eigen::Vector2d at = region_centre(view, march.samples()[i].region);
      const Stretch* sight = in_sight.sight.within(at.x(), at.y(), range);
      if (!sight) continue;
      march.begin(packet.count, view.camera.ray(at.x(), at.y()), range, sight);
      packet.sample[packet.count++] = static_cast<int>(i);
      if (packet.count == kLanes) flush();
    }
    flush();
  };

  double begin = view.plan.range.begin;
  std::size_t first = 0;
  for (int level = view.plan.root_level; first < march.samples().size(); --level) {
    const Stretch range = served_range(view, {level, 0, 0}, begin);
    const std::size_t end = march.samples().size();
    march_level(first, end, range);
    const bool last = range.end >= view.plan.range.end || level == view.plan.finest_level;
    for (std::size_t i = first; i < end; ++i) {
      if (!march.divides(view, i, last)) continue;
      const Region region = march.samples()[i].region;
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

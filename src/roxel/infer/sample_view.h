#pragma once
/// A photograph ready to be marched: its camera, its samples and which of them serve which depths.

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "roxel/image/sample_pyramid.h"
#include "roxel/march/sample_plan.h"

namespace roxel {

struct SampleView {
  PinholeCamera camera;
  std::shared_ptr<const SamplePyramid> pyramid;  ///< null: made by make_pyramid whenever it is needed
  std::function<std::shared_ptr<const SamplePyramid>()> make_pyramid = {};
  SamplePlan plan;
  SamplePlan draft_plan;  ///< the same with samples of twice the size, for passes that prepare others
  /// Observation weight of one pixel; a sample's weight is its usable area in pixels times this, so children
  /// share their parent's weight (docs/rays.md).
  float pixel_weight = 1;
};

/// The views of one capture node.
using SampleNode = std::vector<SampleView>;

/// The same with its pyramid in memory: what is marched.
inline SampleView resident(SampleView view) {
  if (!view.pyramid) view.pyramid = view.make_pyramid();
  return view;
}

inline SampleNode resident(const SampleNode& node) {
  SampleNode views;
  views.reserve(node.size());
  for (const SampleView& view : node) views.push_back(resident(view));
  return views;
}

/// A square region of a view: column and row at a pyramid level.
struct Region {
  int level, x, y;

  Region child(int which) const { return {level - 1, 2 * x + (which & 1), 2 * y + (which >> 1)}; }
};

/// The pixel position of the region's centre, cut at the image border: where its ray goes through.
inline Eigen::Vector2d region_centre(const SampleView& view, const Region& region) {
  const int side = 1 << region.level;
  const auto centre = [side](int index, int size) {
    return 0.5 * (index * side + std::min((index + 1) * side, size));
  };
  return {centre(region.x, view.camera.intrinsics.width), centre(region.y, view.camera.intrinsics.height)};
}

inline Ray region_ray(const SampleView& view, const Region& region) {
  const Eigen::Vector2d at = region_centre(view, region);
  return view.camera.ray(at.x(), at.y());
}

inline bool inside(const SampleView& view, const Region& region) {
  return region.x < view.pyramid->width(region.level) && region.y < view.pyramid->height(region.level);
}

inline float observation_weight(const SampleView& view, const Region& region, float valid) {
  return valid * view.pixel_weight * static_cast<float>(std::int64_t{1} << (2 * region.level));
}

inline float observation_weight(const SampleView& view, const Region& region, const RegionStats& sample) {
  return observation_weight(view, region, sample.valid);
}

/// The stretch of depths that the region's sample serves, from where its parent stopped.
inline Stretch served_range(const SampleView& view, const Region& region, double begin) {
  return {begin, std::min(view.plan.range.end, view.plan.serves_until(region.level))};
}

}  // namespace roxel

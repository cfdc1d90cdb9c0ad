#pragma once
/// A photograph ready to be marched: its camera, its samples and which of them serve which depths.

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "roxel/image/sample_pyramid.h"
#include "roxel/march/sample_plan.h"

namespace roxel {

struct SampleView {
  PinholeCamera camera;
  std::shared_ptr<const SamplePyramid> pyramid;
  SamplePlan plan;
  /// Observation weight of one pixel; a sample's weight is its usable area in pixels times this, so children
  /// share their parent's weight (docs/rays.md).
  float pixel_weight = 1;
};

/// The views of one capture node.
using SampleNode = std::vector<SampleView>;

/// A square region of a view: column and row at a pyramid level.
struct Region {
  int level, x, y;

  Region child(int which) const { return {level - 1, 2 * x + (which & 1), 2 * y + (which >> 1)}; }
};

/// The ray through the centre of the region, cut at the image border.
inline Ray region_ray(const SampleView& view, const Region& region) {
  const double side = std::ldexp(1.0, region.level);
  const auto centre = [side](int index, int size) {
    return 0.5 * (index * side + std::min((index + 1) * side, static_cast<double>(size)));
  };
  return view.camera.ray(centre(region.x, view.camera.intrinsics.width),
                         centre(region.y, view.camera.intrinsics.height));
}

inline bool inside(const SampleView& view, const Region& region) {
  return region.x < view.pyramid->width(region.level) && region.y < view.pyramid->height(region.level);
}

inline float observation_weight(const SampleView& view, const Region& region, const RegionStats& sample) {
  return std::ldexp(sample.valid * view.pixel_weight, 2 * region.level);
}

/// The stretch of depths that the region's sample serves, from where its parent stopped.
inline Stretch served_range(const SampleView& view, const Region& region, double begin) {
  return {begin, std::min(view.plan.range.end, view.plan.serves_until(region.level))};
}

}  // namespace roxel

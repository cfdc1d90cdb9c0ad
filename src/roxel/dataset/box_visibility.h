#pragma once
/// How well the views see a box, and warnings where a scale makes no sense.

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "roxel/dataset/bounds.h"
#include "roxel/dataset/dataset.h"

namespace roxel {

struct BoxVisibility {
  int views = 0;                       ///< views that see some of the box
  double share_seen_twice = 0;         ///< share of the box's volume that at least two nodes see; 0 to 1
  double min_pixels_per_voxel = 0;     ///< width of one voxel in pixels at the box's nearest depth to ...
  double median_pixels_per_voxel = 0;  ///< ... its centre, over the views that see some of the box; 0 where
  double max_pixels_per_voxel = 0;     ///< none does
};

/// `voxel_size` in world units, > 0.
BoxVisibility box_visibility(const Dataset& dataset, const SceneBounds& bounds, double voxel_size);

/// Nonsense scales: a box that no or few views see, voxels far below or far above a pixel, a box far larger
/// than what the views share. Each says what was found and what to change. Empty when all is well.
std::vector<std::string> scale_warnings(const Dataset& dataset, const SceneBounds& bounds, double voxel_size);

}  // namespace roxel

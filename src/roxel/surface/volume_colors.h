#pragma once
/// What colour the volume gives to points of a surface, in canonical light.

#include "roxel/color/color_space.h"
#include "roxel/volume/volume.h"

namespace roxel {

/// Linear RGB, 1 = the volume's exposure: the mean of the box's voxels around each point, up to two voxels
/// away, weighted by nearness, opacity and how often they were seen. Grey (0.5) where there are none.
std::vector<std::array<float, 3>> volume_colors(const std::vector<Eigen::Vector3d>& points,
                                                const Volume& volume, const ColorTransform& colors,
                                                int threads);

}  // namespace roxel

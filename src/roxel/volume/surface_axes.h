#pragma once
/// Which way the volume's surfaces lie, from the gradient of its opacities.

#include <Eigen/Core>
#include <vector>

#include "roxel/volume/volume.h"

namespace roxel {

/// Of every voxel of the box, the unit vector along which opacity changes most around it: the first axis of
/// the structure tensor, the outer products of the gradient summed over neighbours (Gaussian, about two
/// voxels wide). Thin sheets, where the gradient itself is zero, have one, too. Its sign means nothing; zero
/// where opacity does not change. The same for any number of threads.
std::vector<Eigen::Vector3f> surface_axes(const Volume& volume, int threads);

}  // namespace roxel

#pragma once
/// The step between two levels of resolution: drop what is empty or hardly seen, keep a margin, divide.
/// [Jethwa04] §5.2, §7.2.4.

#include "roxel/volume/volume.h"

namespace roxel {

struct RefineOptions {
  float opacity_threshold = 0;     ///< keeps voxels with opacity >= this, in [0, 1)
  float confidence_threshold = 0;  ///< and with confidence >= this, in [0, 1)
  float prior_opacity = 0.02f;  ///< alpha_0 of new voxels, and the least opacity of divided ones, in [0, 1)
  int dilate_voxels = 1;        ///< margin around what is kept, in voxels before division
  bool subdivide = true;        ///< each voxel into eight; otherwise only drop and dilate
};

/// The volume of the next level, lattice by lattice; surround stays out of the lattice within.
/// Divided voxels inherit colour, its weight, and confidence; tau halves with the voxel's side, but not below
/// the prior's, and support starts at 0. Voxels that dilation creates (or puts back) start at the prior with
/// everything else 0. Without division, what is kept stays as it is. `threads` does not change the result.
Volume refine(const Volume& volume, const RefineOptions& options, int threads = 1);

}  // namespace roxel

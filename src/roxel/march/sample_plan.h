#pragma once
/// Which samples of an image serve which depths (docs/rays.md; [Jethwa04] sections 5.1.1 and 7.1).
///
/// A sample is a square region of 2^level pixels a side, as in SamplePyramid. A sample whose region has
/// diagonal l pixels serves depths up to z = s f / (l m), for voxel size s, focal length f and m samples a
/// voxel; past it, it divides into its four children. No sample is finer than a pixel or than L = f s / (D
/// m), D the far distance: finer samples add nothing.

#include <limits>
#include <vector>

#include "roxel/march/ray_walk.h"

namespace roxel {

struct SamplePlanOptions {
  double samples_per_voxel = 1;  ///< m, along an axis, > 0
  bool adaptive = true;          ///< false: the limiting sample size at every depth
  int max_root_level = 6;        ///< roots are at most 2^6 = 64 pixels wide
};

struct SamplePlan {
  int finest_level = 0;
  int root_level = 0;
  Stretch range{0, 0};  ///< near to far, world units along the optical axis

  /// Largest depth that samples of `level` serve; infinite for the finest level.
  double serves_until(int level) const {
    return level <= finest_level ? std::numeric_limits<double>::infinity() : serves_until_[level];
  }
  /// The level whose samples serve as far as the range goes: none divides further.
  int last_level() const {
    int level = root_level;
    while (level > finest_level && serves_until(level) < range.end) --level;
    return level;
  }
  std::vector<double> serves_until_;

  /// The plan whose samples are twice as wide at every depth, and so a quarter as many.
  SamplePlan coarser() const;
};

/// The plan of one view for voxels of `voxel_size` inside `box`. `range` is cut to what can hold voxels by
/// the caller.
SamplePlan make_sample_plan(const PinholeCamera& camera, const Eigen::AlignedBox3d& box, double voxel_size,
                            Stretch range, const SamplePlanOptions& options);

}  // namespace roxel

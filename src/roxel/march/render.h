#pragma once
/// The volume as a camera sees it: I = sum of r_s c_s + r_bg c_bg with r_s = a_s T_s (docs/rays.md).

#include <array>
#include <vector>

#include "roxel/base/run_context.h"
#include "roxel/image/image.h"
#include "roxel/march/ray_walk.h"

namespace roxel {

struct RenderOptions {
  std::array<float, 3> background = {0, 0, 0};  ///< linear RGB, where rays leave the volume
  bool surround = true;                         ///< lattices around the box are seen, too
};

struct Rendering {
  Image rgb;      ///< linear, 3 channels
  Image depth;    ///< mean distance along the optical axis of what the rays end in, world units; 0 = nothing
  Image opacity;  ///< 1 - r_bg, over the box's voxels alone
};

/// One ray through each pixel's centre, between the depths of `range`; `colors` is linear RGB, one entry a
/// slot.
Rendering render(const LatticeStack& stack, const std::vector<std::array<float, 3>>& colors,
                 const PinholeCamera& camera, Stretch range, const RenderOptions& options,
                 const RunContext& context);

}  // namespace roxel

#pragma once
/// Depth and its variance per pixel, from the responsibilities of the voxels along the pixel's ray
/// ([Jethwa04] section 6.2; docs/depth.md).

#include "roxel/infer/run_pass.h"
#include "roxel/march/render.h"

namespace roxel {

/// Planes of one float a pixel, of the view's size.
struct DepthMap {
  Image depth;     ///< distance along the optical axis, world units; 0 = none (opacity below kLeastOpacity)
  Image variance;  ///< mean square of where the ray ends less `depth`, over all r, world units squared
  Image opacity;   ///< posterior probability that the ray ends in the box

  static constexpr float kLeastOpacity = 0.05f;
};

enum class DepthEstimate {
  kMean,      ///< sum r d / sum r: [Jethwa04] eq. (6.1)
  kMedian,    ///< the depth that half of the responsibility lies in front of
  kMainMode,  ///< mean over the stretch of responsibility around the median that is not broken by a gap
};

struct DepthOptions {
  DepthEstimate estimate = DepthEstimate::kMainMode;
  bool likelihood = true;  ///< weigh by the posterior r_s; false: by a_s T_s, without looking at the image
};

/// For a rendering beside the depth map, from the same walk along each ray.
struct RenderBeside {
  const std::vector<std::array<float, 3>>& colors;  ///< linear RGB, one entry a slot
  RenderOptions options;
};

struct SeenView {
  DepthMap depth;
  Rendering rendering;  ///< empty where none was asked for
};

/// The depth maps of a node's views at full resolution (level 0 alone), and with `render` what they look
/// like. The scratch holds the colours to compare with (compare_with_others). World variance includes s^2/12
/// for the voxel's extent.
std::vector<SeenView> estimate_depth(const LatticeStack& stack, const SampleNode& views,
                                     const PassOptions& pass, const DepthOptions& options,
                                     const RenderBeside* render, const RunContext& context,
                                     NodeScratch& scratch);

}  // namespace roxel

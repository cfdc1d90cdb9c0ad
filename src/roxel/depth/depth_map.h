#pragma once
/// Depth and its variance per pixel, from the responsibilities of the voxels along the pixel's ray
/// ([Jethwa04] section 6.2; docs/depth.md).

#include "roxel/base/option_table.h"
#include "roxel/infer/run_pass.h"

namespace roxel {

/// Planes of one float a pixel, of the view's size.
struct DepthMap {
  Image depth;     ///< distance along the optical axis, world units; 0 = none (opacity below kLeastOpacity)
  Image variance;  ///< mean square of where the ray ends less `depth`, over all r, world units squared
  Image opacity;   ///< posterior probability that the ray ends in the box

  static constexpr float kLeastOpacity = 0.05f;
};

enum class DepthEstimate {
  kMean,      ///< sum w d / sum w: [Jethwa04] eq. (6.1)
  kMedian,    ///< the depth that half of the responsibility lies in front of
  kMainMode,  ///< mean over the stretch of responsibility around the median that is not broken by a gap
};

enum class DepthWeight {
  kPosterior,     ///< r_s: where the ray ends, given the pixel's colour
  kTimesOpacity,  ///< r_s a_s: [Jethwa04] eq. (6.1); counts opacity twice, so that variances are too small
  kPrior,         ///< a_s T_s: without looking at the image
};

struct DepthOptions {
  DepthEstimate estimate = DepthEstimate::kMainMode;
  DepthWeight weight = DepthWeight::kPosterior;
};

/// Group "Depth": depth-estimate, depth-weight.
const OptionTable<DepthOptions>& depth_map_option_table();

/// The depth maps of a node's views at full resolution (level 0 alone). The scratch holds the colours to
/// compare with (compare_with_others). World variance includes s^2/12 for the voxel's extent.
std::vector<DepthMap> estimate_depth(const LatticeStack& stack, const SampleNode& views,
                                     const PassOptions& pass, const DepthOptions& options,
                                     const RunContext& context, NodeScratch& scratch);

}  // namespace roxel

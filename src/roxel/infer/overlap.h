#pragma once
/// Places that few nodes have in their frames although many have what lies behind.
///
/// Whatever colour a ray shows, some place on it agrees with the photographs of one other node by chance;
/// with those of many nodes hardly any does. Near the cameras, where frames do not overlap yet, such places
/// make islands that hang before what they hide, above all before surfaces that shine. How many nodes have a
/// place in their frames is known before anything is looked at.

#include <vector>

#include "roxel/base/run_context.h"
#include "roxel/infer/sample_view.h"

namespace roxel {

/// Removes the voxels whose centre fewer nodes have in frame than two, or than the share `min_overlap` (0 to
/// 1) of the most that have a place behind it in the box (lattices[0]), as the mean over the rays to the
/// voxel of all views that have it in frame. Where no two nodes share a place in the box, one is enough. What
/// surrounds the box behind it stays: nothing there is seen better. Occlusion and masks do not count; rays
/// are told apart to a 24th of the frame's sides, depths to a 32nd of the box's range in logarithm. The
/// result does not depend on the number of threads. Returns how many of the box were removed. Throws
/// Cancelled.
std::int64_t drop_little_seen(const std::vector<SampleNode>& nodes, double min_overlap,
                              const RunContext& context, std::vector<Topology>& lattices);

}  // namespace roxel

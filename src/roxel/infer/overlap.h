#pragma once
/// Places that few nodes have in their frames although many have what lies behind.
///
/// Whatever colour a ray shows, some place on it agrees with the photographs of one other node by chance;
/// with those of many nodes hardly any does. Near the cameras, where frames do not overlap yet, such places
/// make islands that hang before what they hide, above all before surfaces that shine. How many nodes have a
/// place in their frames is known before anything is looked at.

#include <cstdint>
#include <vector>

#include "roxel/base/run_context.h"
#include "roxel/infer/sample_view.h"
#include "roxel/volume/volume.h"

namespace roxel {

/// A set of which this share of the nodes have one place in frame was taken of that place.
inline constexpr double kMostNodes = 2.0 / 3;
/// Elsewhere less is asked for, by this factor: what stands before a wall that cameras pass is in as many
/// frames as its share of the wall's distance;
inline constexpr double kLessElsewhere = 0.6;
/// and so many nodes are enough.
inline constexpr int kEnoughNodes = 12;
/// Places are compared with those of a box so many times as large: rays at the rims of frames pass it by.
inline constexpr double kComparedPlaces = 1.5;

/// Removes voxels that lie before places which more nodes have in frame. With B the most nodes that have one
/// place at or behind the voxel on the ray, inside `box` (world) grown by kComparedPlaces about its centre,
/// as the mean over all views that have the voxel's centre in frame (0 where nothing of that box lies
/// behind): those that fewer than two nodes have, or fewer than `min_overlap` (0 to 1) times B if B is most
/// of the nodes, else than the lesser of kLessElsewhere times that and kEnoughNodes. Where no two nodes share
/// a place, one is enough. What no frame holds the centre of goes in that box, and where it reaches into a
/// frame nearer than all of it. Occlusion and masks do not count; rays are told apart to a 24th of the
/// frame's sides, depths to a 32nd of that box's range in logarithm. The result does not depend on the number
/// of threads. Returns how many voxels of lattices[0] were removed. Throws Cancelled.
std::int64_t drop_little_seen(const std::vector<SampleNode>& nodes, const Eigen::AlignedBox3d& box,
                              double min_overlap, const RunContext& context, std::vector<Topology>& lattices);

}  // namespace roxel

#pragma once
/// Which photographs share one sky, and what the data set knows of it.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "roxel/dataset/dataset.h"
#include "roxel/sky/sky_fit.h"

namespace roxel {

/// Photographs that were taken farther apart in time than this, in seconds, are in different light.
inline constexpr double kSameSky_s = 900;

struct DatasetSkies {
  std::vector<SkyTask> tasks;               ///< views by name; tasks have different names
  std::vector<std::vector<int>> view_idxs;  ///< of each task, as SkyTask::views
  std::vector<std::string> notes;           ///< what was taken for up, and the like
  std::vector<std::string> warnings;        ///< nodes whose cameras stand in two places
};

/// One sky a node. Nodes of a single view that share a time (to the second) and place share a sky; views of
/// one place taken more than a quarter of an hour apart do not. Tasks are named by node id ("n03"), else by
/// count. Without `up` (world, any length) it is +Z where places are given or cameras agree, else the axis
/// that most cameras hold upright. Throws InvalidInput where one node id stands for two nodes: two times, two
/// latitudes or longitudes, or cameras in two places that are farther apart than nodes are.
DatasetSkies sky_tasks(const Dataset& dataset, const std::optional<std::array<double, 3>>& up = std::nullopt);

/// By how much photographs are made smaller before anything is looked for in their sky: to pixels of at most
/// 0.05 degrees, a thirtieth of a facet. At most 16.
int sky_scale(const PinholeCamera& camera);

/// Threads that look at photographs of up to so many pixels at once, each at one: as many as `most_bytes` of
/// memory allow, at least one.
int sky_workers(std::int64_t pixels, double most_bytes, int threads);

/// The view's pixels, made smaller by sky_scale; `known_sky` (255 = sky, as large as the photograph) or
/// nothing. Where a pixel of the photograph clips, so does the one that holds it.
SkyPicture sky_picture(const View& view, Photograph photograph, const Eigen::Matrix3d& sky_from_world,
                       Mask known_sky = {});

}  // namespace roxel

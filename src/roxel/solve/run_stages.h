#pragma once
/// What follows a reconstruction, one view at a time: its depth map, and the volume as its camera sees it.

#include <functional>

#include "roxel/depth/depth_map.h"
#include "roxel/march/render.h"
#include "roxel/solve/reconstruct.h"

namespace roxel {

struct ViewStageOptions {
  bool depth = true;
  bool render = true;
  DepthOptions depth_options;
  double progress_begin = 0;  ///< fractions of the whole command
  double progress_end = 1;
};

/// One view and what the volume says of it.
struct ViewResult {
  int view_idx = 0;
  Photograph photo;
  DepthMap depth;       ///< empty planes where depth was not asked for
  Rendering rendering;  ///< rgb in the photograph's unit; empty where not asked for
  Image light;  ///< what each pixel is to be divided by, 0 = not known; empty where view_light serves all
  std::array<float, 3> view_light = {1, 1, 1};
};

/// Calls visit for every view, from several threads at once, never twice at once for views of one node. At
/// most 16 views of a node, and one node a thread, are in memory. Throws Cancelled.
void for_each_view_result(const Dataset& dataset, const PhotographLoader& load,
                          const Reconstruction& reconstruction, const ReconstructOptions& options,
                          const ViewStageOptions& stages, RunContext& context,
                          const std::function<void(const ViewResult&)>& visit);

/// Linear RGB of every slot in the photographs' unit: what render() wants.
std::vector<std::array<float, 3>> radiance_colors(const Volume& volume, const ColorTransform& transform,
                                                  double exposure);

/// What a render shows behind the volume: the known background's colour, else black. Photographs' unit.
std::array<float, 3> background_radiance(const Scene& scene);

}  // namespace roxel

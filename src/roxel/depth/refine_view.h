#pragma once
/// Photometric refinement of one view's depth: each pixel's plane is moved, within a few deviations of what
/// the volume says, to where other photographs look most alike (docs/depth.md).

#include <cstdint>
#include <span>

#include "roxel/base/run_context.h"
#include "roxel/depth/patch_match.h"

namespace roxel {

/// A view as refinement sees it.
struct MatchView {
  PinholeCamera camera;
  Image luma;      ///< matching_luma
  Image color;     ///< matching_color; may be empty
  Image depth;     ///< best before refinement, 0 = none
  Image variance;  ///< of it
};

struct PatchMatchOptions {
  PatchOptions patch;
  int sources = 8;             ///< views that a patch is looked for in, at most 32
  int iterations = 3;          ///< rounds of propagation over the view
  double sigmas = 60;          ///< deviations that a depth may move by
  double pixel_sigma = 0.035;  ///< pixels by which calibration errs, alike in all views
  std::int64_t seed = 1;
};

/// Planes of the pixels, and the variance of their inverse depth at the pixel's centre (0 where there is no
/// plane).
struct RefinedView {
  PlaneMap planes;
  Image variance;     ///< of w
  Image shared;       ///< the part of it that other views have in common: the volume's say, and calibration
  Image correlation;  ///< mean over the views that show it best; 0 = none agrees, the photographs say nothing
};

/// `sources` show what the view shows; where they do is known from their depth. `start`: a plane for each
/// pixel that has depth. Rows are shared among the context's threads; results do not depend on how many.
RefinedView refine_view(const MatchView& view, std::span<const MatchView* const> sources,
                        const PlaneMap& start, const PatchMatchOptions& options, const RunContext& context);

}  // namespace roxel

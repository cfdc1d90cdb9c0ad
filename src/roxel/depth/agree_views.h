#pragma once
/// What several views say of the same surface, joined: each pixel asks the refined depth maps of other views
/// what they see along its ray (docs/depth.md).

#include <span>

#include "roxel/base/run_context.h"
#include "roxel/depth/patch_match.h"
#include "roxel/depth/refine_view.h"

namespace roxel {

struct AgreeingView {
  const RefinedView* view = nullptr;
  PatchWarp warp;  ///< from the view that asks
};

/// One view after the others were asked.
struct AgreedView {
  PlaneMap planes;
  Image variance;      ///< of w
  Image views;         ///< how many others agree that photographs said something of
  double stretch = 1;  ///< by which deviations were too small, as the views differ
};

AgreedView agree_views(const RefinedView& own, std::span<const AgreeingView> others,
                       const RunContext& context);

}  // namespace roxel

#pragma once
/// The points that the depth maps of a run show, as one set.

#include <cstdint>
#include <vector>

#include "roxel/camera/camera.h"
#include "roxel/image/image.h"

namespace roxel {

/// The depth map of one view; 1 channel, along the optical axis, 0 = none.
struct ViewDepth {
  PinholeCamera camera;
  Image depth;
};

struct DepthPointOptions {
  int views_that_agree =
      1;                 ///< a pixel counts where the maps of so many views, its own one among them, agree
  double tolerance = 0;  ///< how far depths may differ along the other view's axis to agree, world units
  int stride = 1;  ///< pixels from one that counts to the next, in rows and columns; the first is the middle
                   ///< of a stride
};

/// One point a pixel with depth, in the order of views and pixels.
std::vector<Eigen::Vector3d> depth_points(const std::vector<ViewDepth>& views,
                                          const DepthPointOptions& options, int threads);

/// The smallest stride by which no more than `most` pixels of all views together count.
int pixel_stride(const std::vector<ViewDepth>& views, std::int64_t most);

}  // namespace roxel

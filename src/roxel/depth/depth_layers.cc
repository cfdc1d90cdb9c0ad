#include "roxel/depth/depth_layers.h"

#include <cmath>

#include "roxel/base/error.h"

namespace roxel {

Image believed_depth(const DepthLayers& layers) {
  Image depth = layers.depth;
  for (std::size_t i = 0; i < depth.data().size(); ++i) {
    float& z = depth.data()[i];
    if (!(layers.opacity.data()[i] > 0.5f) || !(z > 0) || !std::isfinite(z)) z = 0;
  }
  return depth;
}

Image sure_depth(const DepthEstimates& estimates, double most_sigma) {
  ROXEL_CHECK(estimates.depth.data().size() == estimates.variance.data().size());
  Image depth = estimates.depth;
  for (std::size_t i = 0; i < depth.data().size(); ++i)
    if (!(estimates.variance.data()[i] <= most_sigma * most_sigma)) depth.data()[i] = 0;
  return depth;
}

DepthEstimates best_estimates(const DepthLayers& layers) {
  if (!layers.depth_refined.empty()) return {layers.depth_refined, layers.variance_refined};
  if (!layers.depth_bp.empty()) return {layers.depth_bp, layers.variance_bp};
  return {believed_depth(layers), layers.variance};
}

}  // namespace roxel

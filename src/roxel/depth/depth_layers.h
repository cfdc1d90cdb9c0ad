#pragma once
/// What is known of one view's depth: from the volume, after belief propagation, after refinement.

#include "roxel/image/image.h"

namespace roxel {

/// Images of one size. `depth` is always there; others may be empty.
struct DepthLayers {
  Image depth;                  ///< Z: along the optical axis, world units, 0 = none
  Image variance;               ///< V: of Z, world units squared
  Image opacity;                ///< A: of the ray, in [0, 1]
  Image depth_bp = {};          ///< Z.bp: after belief propagation
  Image variance_bp = {};       ///< V.bp
  Image depth_refined = {};     ///< Z.refined: after photometric refinement
  Image variance_refined = {};  ///< V.refined
  Image normal = {};  ///< N.x, N.y, N.z: 3 channels, unit vectors in the world towards the camera; 0 = none
};

/// One estimate of a view's depth: world units along the optical axis, 0 = none, and its variance.
struct DepthEstimates {
  Image depth, variance;
};

/// The volume's, where its rays are more opaque than one half; 0 elsewhere.
Image believed_depth(const DepthLayers& layers);

/// Depth whose deviation is at most `most_sigma`, world units; 0 elsewhere.
Image sure_depth(const DepthEstimates& estimates, double most_sigma);

/// The best that the layers hold: refined, else after belief propagation, else what is believed of Z.
DepthEstimates best_estimates(const DepthLayers& layers);

}  // namespace roxel

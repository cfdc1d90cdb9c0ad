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

}  // namespace roxel

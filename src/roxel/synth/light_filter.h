#pragma once
/// Takes the grain of few light paths out of what falls on surfaces.

#include "roxel/camera/camera.h"
#include "roxel/image/image.h"

namespace roxel {

/// What a pixel's middle shows.
struct SurfaceGuide {
  Image depth;   ///< along the optical axis, 0 = no surface
  Image normal;  ///< unit, in world coordinates
};

/// Weighted means of `light` (three channels) over neighbouring pixels that lie in one plane and face one
/// way, up to 2^(passes + 1) - 2 pixels away: the edge-avoiding wavelet of [Dammertz10] without its term for
/// brightness, so that a mean over a surface stays what it was. Pixels without a surface stay as they are.
Image smoothed_light(Image light, const SurfaceGuide& guide, const PinholeCamera& camera, int passes);

}  // namespace roxel

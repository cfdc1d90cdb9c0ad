#pragma once
/// The light of a photograph that took no part in a run, so that a render can be held against it.

#include <array>

#include "roxel/color/response.h"
#include "roxel/image/image.h"

namespace roxel {

/// The factor of each channel of `rendered` (linear, 3 channels, 1 = display white; in `photo` that is
/// `white`) that makes the sum of (encoded render - encoded photograph)^2 least over pixels whose `counted`
/// is at least 128 (empty: all); both are clipped to what a display shows. 1 in a channel where nothing of
/// the render can be seen there. At most about 60 000 pixels, evenly spread, decide. Factors from e^-4 to
/// e^4, to a hundredth of a percent. Throws std::logic_error where sizes differ.
std::array<double, 3> display_gain(const Image& rendered, const Image& photo, double white,
                                   const Mask& counted, const Response& response);

}  // namespace roxel

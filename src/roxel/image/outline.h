#pragma once
/// The outline of an object in its mask.

#include "roxel/image/image.h"

namespace roxel {

/// `valid` (empty = all 255, or of the mask's size) where the background beside the object's outline weighs
/// less: values of pixels below 128 in `foreground` are multiplied by `weight` (0 to 1) where the centre of a
/// pixel of 128 or more is within `radius_px` (>= 0). A weight of 1, a radius below 1 and an empty
/// `foreground` change nothing.
Mask lighter_beside_outline(const Mask& valid, const Mask& foreground, double radius_px, double weight);

}  // namespace roxel

#pragma once
/// The outline of an object in its mask.

#include "roxel/image/image.h"

namespace roxel {

/// `valid` (empty = all 255, or of the mask's size) times w + (1 - w)(1 - 2f)^2 at the pixels of which the
/// mask calls a share f object, more than 2 % and less than 98 %, beside one that is all object's (of the
/// eight around): the object's outline passes through them. w is `least`, 0 to 1. Such a pixel shows both
/// object and background, and where in it either is cannot be told: its ray neither ends at the object nor
/// passes it, the less so the more of both it shows. What is thinner than a pixel has no pixel of its own and
/// keeps those that it has a part of. A `least` of 1, an empty `foreground` and masks of all or nothing
/// change nothing.
Mask lighter_on_outline(const Mask& valid, const Mask& foreground, double least);

}  // namespace roxel

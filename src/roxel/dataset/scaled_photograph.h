#pragma once
/// Photographs and their cameras at a whole fraction of their size.

#include "roxel/dataset/dataset.h"

namespace roxel {

/// A camera whose pixels are scale x scale of the other's; rows and columns left over are cut off.
PinholeCamera scaled(PinholeCamera camera, int scale);

/// Means over squares of pixels, valid where all of them are; masks of object and sky are left out. At scale
/// 1 the photograph as it is.
Photograph scaled(const Photograph& photo, int scale);

/// Means over squares of pixels, rounded.
Mask scaled(const Mask& mask, int scale);

/// A mask of the size that the other was scaled from, bilinear; rows and columns that were cut off continue
/// the last ones.
Mask enlarged(const Mask& mask, int scale, int width, int height);

}  // namespace roxel

#pragma once
/// How far renders are from photographs, in the eyes of a viewer: errors of display-encoded (sRGB) values.

#include <cstdint>

#include "roxel/image/image.h"

namespace roxel {

/// Summed squared error; add() joins views, so that the RMS is over all their pixels together.
struct ImageError {
  double squared_sum = 0;  ///< of encoded values in [0, 1], over pixels and channels
  std::int64_t pixel_count = 0;

  /// sqrt(squared_sum / (3 pixel_count)) in percent of full scale; 0 without pixels.
  double rms_percent() const;
  void add(const ImageError& other);
};

/// `render` and `photo` are linear RGB of one size; both are clamped to [0, 1] and sRGB-encoded first. Counts
/// pixels whose mask is at least 128 (all where the mask is empty). A render value that is not finite counts
/// as 0. Throws std::logic_error where sizes differ.
ImageError image_error(const Image& render, const Image& photo, const Mask& mask);

/// RMS over the pixels that show the object, in percent of full scale, as the thesis's tables have it.
double reprojection_rms(const Image& render, const Image& photo, const Mask& mask);

}  // namespace roxel

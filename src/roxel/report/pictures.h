#pragma once
/// Pictures for people: depth in false colour, errors as heat, and a sheet that shows several views side by
/// side. Pictures are display values: 3 channels in [0, 1] as they stand in a PNG (already encoded).

#include <vector>

#include "roxel/color/response.h"
#include "roxel/image/image.h"

namespace roxel {

/// Light as a PNG shows it: divided by `white`, encoded by `response`, clamped to [0, 1].
Image encoded_picture(const Image& linear_rgb, double white, const Response& response);

/// Depths that a picture spreads its colours over.
struct ShownDepths {
  float near = 0;
  float far = 0;
};

/// The 2nd and 98th percentile of the depths of pixels that are more opaque than one half; 0, 0 without any.
ShownDepths shown_depths(const Image& depth, const Image& opacity);

/// Near is warm (pale yellow, orange), far is cold (violet, deep blue), no depth is black; a pixel's colour
/// fades with its opacity, and slopes are shaded as if lit from the viewer's upper left.
Image depth_picture(const Image& depth, const Image& opacity, const ShownDepths& shown);

/// Error at which the heat is white: a quarter of full scale.
inline constexpr float kHottestError = 0.25f;

/// Root mean square over the channels of the difference of two pictures as heat: black (none), violet, red,
/// yellow, white (kHottestError and more). Black, too, where `valid` is 0. Where `foreground` (empty: all
/// object) says that most of a pixel is not object, nothing should be seen, and the render is compared with
/// black.
Image error_picture(const Image& render, const Image& photo, const Mask& valid, const Mask& foreground);

/// Deviation at which the heat is white, in voxels.
inline constexpr float kHottestSigma = 4;

/// The deviation of depths as heat: black (sure), violet, red, yellow, white (kHottestSigma voxels and more).
/// Grey where a pixel has no depth, or is not more opaque than one half.
Image sigma_picture(const Image& variance, const Image& depth, const Image& opacity, double voxel_size);

/// Error of a depth at which its picture is fullest, in voxels.
inline constexpr float kFullestDepthError = 4;

/// Depths against the truth (0 = no surface): white where they agree, blue where they are too near, red too
/// far, full at kFullestDepthError voxels and more. Black where only one of the two has a depth, grey where
/// neither has. An estimate has a depth where it is more opaque than one half.
Image depth_error_picture(const Image& depth, const Image& opacity, const Image& truth, double voxel_size);

/// The picture at most `width` wide, averaged over areas; never enlarged.
Image thumbnail(const Image& picture, int width);

/// Rows of pictures on dark grey with thin gaps; pictures may differ in size, columns are as wide as their
/// widest.
Image contact_sheet(const std::vector<std::vector<Image>>& rows);

}  // namespace roxel

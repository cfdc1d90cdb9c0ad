#pragma once
/// Reconstructed colours against true albedo. A reconstruction cannot know how bright the light was, so one
/// factor, common to all channels and pixels, is free.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace roxel {

/// Linear RGB of one place.
struct ColorPair {
  std::array<float, 3> estimate;
  std::array<float, 3> truth;
};

struct ColorAccuracy {
  std::int64_t pixels = 0;
  double scale = 1;         ///< estimates times it are nearest to the truth, in least squares of linear RGB
  double mean_delta_e = 0;  ///< CIEDE2000 [Sharma05] of the scaled estimate, white D65
  double median_delta_e = 0;
  double delta_e_90 = 0;     ///< that 90 % of the pixels are within
  double mean_relative = 0;  ///< |scaled estimate - truth| / |truth|, Euclidean in linear RGB
  double median_relative = 0;
};

/// The colour of what a pixel rendered over black shows, however much of the pixel it fills, beside the
/// truth; none where one is not finite. Both are linear RGB.
std::optional<ColorPair> color_pair(const float* over_black, float opacity, const float* truth);

/// Pairs whose truth is black are left out, of the scale too: a relative error means nothing there. All 0
/// and a scale of 1 without pairs.
ColorAccuracy color_accuracy(std::vector<ColorPair> pairs);

}  // namespace roxel

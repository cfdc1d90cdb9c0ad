#pragma once
/// What a voxel is painted with in renders and files. (A mesh has the photographs' colours, and where none
/// shows it mean ones: surface/volume_colors.h.)

#include <array>

#include "roxel/color/color_space.h"
#include "roxel/volume/volume.h"

namespace roxel {

/// Linear RGB >= 0, 1 = display white: the fitted colour where there is one, else the mean, which is in the
/// space of `transform`.
inline std::array<float, 3> shown_color(const Volume& volume, const ColorTransform& transform,
                                        std::uint32_t slot) {
  if (!volume.fitted_color.empty()) return volume.fitted_color[slot];
  std::array<float, 3> rgb;
  transform.to_rgb(volume.color_mean[slot].data(), rgb.data());
  for (float& value : rgb) value = value > 0 ? value : 0.0f;
  return rgb;
}

}  // namespace roxel

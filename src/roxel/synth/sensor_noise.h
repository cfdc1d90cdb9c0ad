#pragma once
/// What a sensor adds to a photograph.

#include <cstdint>

#include "roxel/image/image.h"

namespace roxel {

/// Photon and quantisation noise, in place and in linear light. Photons are counted: `sigma_at_white` is the
/// standard deviation at value 1 (0.01 = ten thousand photons there), and elsewhere it is that times the
/// value's square root. The count is then rounded to one of 4096 steps; above 1 steps and range double with
/// every doubling of the value, as a bracket of exposures has them. `image` and `seed` choose the noise.
void add_sensor_noise(Image& rgb, double sigma_at_white, int image, std::uint32_t seed);

}  // namespace roxel

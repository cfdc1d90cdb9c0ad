#pragma once
/// An urban block: a long square between rows of houses, with trees, cars and a fountain. Metres, the
/// pavement at z = 0, turned away from north; the square runs from x = -42 to 42 and y = -9 to 9 in its own
/// frame.

#include <Eigen/Geometry>

#include "roxel/synth/world.h"

namespace roxel {

/// The frame of the block in the world.
Eigen::Affine3f street_frame();

/// Fills mesh, materials and stages, and the bounds: a box around all houses.
void build_street_block(World& world, std::uint32_t seed);

}  // namespace roxel

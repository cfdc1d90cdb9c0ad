#pragma once
/// The demo world's paints and stones: diffuse albedo as a function of position.

#include <Eigen/Core>
#include <cstdint>

#include "roxel/synth/demo_scene.h"

namespace roxel {

/// Linear RGB in [0, 1] at surface point `p` with outward `normal`, of the index-th thing of its part.
Eigen::Vector3f demo_texture(DemoPart part, int index, const Eigen::Vector3f& p,
                             const Eigen::Vector3f& normal, std::uint32_t seed);

}  // namespace roxel

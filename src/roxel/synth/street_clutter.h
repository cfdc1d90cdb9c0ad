#pragma once
/// What stands about in streets: trees, lamps, cars, benches. Each on z = 0 at the placement's origin,
/// metres.

#include <cstdint>

#include "roxel/synth/mesh_builder.h"

namespace roxel {

/// Branches with loose leaves; six to nine metres.
void add_tree(MeshBuilder& build, const Eigen::Affine3f& place, int bark, int leaves, std::uint32_t seed);
void add_lamp_post(MeshBuilder& build, const Eigen::Affine3f& place, int metal, int globe);
void add_car(MeshBuilder& build, const Eigen::Affine3f& place, int body, int glass, int tyre);
void add_bench(MeshBuilder& build, const Eigen::Affine3f& place, int wood, int metal);
void add_bollard(MeshBuilder& build, const Eigen::Affine3f& place, int stone);
/// A round basin with a column in its middle.
void add_fountain(MeshBuilder& build, const Eigen::Affine3f& place, int stone, int water);

}  // namespace roxel

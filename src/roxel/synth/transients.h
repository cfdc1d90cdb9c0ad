#pragma once
/// Things that stand in a world at one occasion only: passers-by, parked things, a bird before the lens.

#include <cstdint>

#include "roxel/synth/triangle_mesh.h"
#include "roxel/synth/world.h"

namespace roxel {

/// `count` things on the world's stages, made for this occasion alone; their materials are added to the
/// world's.
TriangleMesh make_transients(World& world, int occasion, int count, std::uint32_t seed);

}  // namespace roxel

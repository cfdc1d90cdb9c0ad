#pragma once
/// RUN/mesh.ply: a surface with normals and colours, for programs that know meshes.

#include <filesystem>

#include "roxel/surface/surface.h"

namespace roxel {

/// Binary little-endian PLY: float x y z, and where the surface has them float nx ny nz and uchar red green
/// blue (sRGB, clipped); faces as lists of three. Coordinates are double where floats are too coarse for
/// them. Atomic; throws IoError.
void write_surface_ply(const std::filesystem::path& path, const Surface& surface);

/// Whether coordinates are so large beside the surface that floats lose its shape: more than 1e-6 of its
/// size.
bool floats_are_too_coarse(const Mesh& mesh);

}  // namespace roxel

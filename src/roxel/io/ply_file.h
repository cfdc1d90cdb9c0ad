#pragma once
/// Meshes and point sets as PLY [Turk94]: ascii and binary of either byte order. Of vertices x, y, z are
/// read, of faces the list of vertex indices; polygons are cut into triangles as a fan from their first
/// corner. All other elements and properties are passed over.

#include <filesystem>

#include "roxel/surface/mesh.h"

namespace roxel {

/// Throws InvalidInput, naming file and line or byte, what was found and what was expected, when the file is
/// missing, no PLY, cut off, has no vertices, coordinates that are not finite, or indices out of range.
Mesh read_ply(const std::filesystem::path& path);

}  // namespace roxel

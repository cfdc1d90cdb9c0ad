#pragma once
/// RUN/voxels.ply: voxels as coloured points, for programs that know point clouds.

#include <cstdint>
#include <filesystem>

#include "roxel/color/color_space.h"
#include "roxel/volume/volume.h"

namespace roxel {

/// Writes the voxels of lattice 0 at or above both thresholds, in slot order, as binary little-endian PLY:
/// float x y z (centre, world), uchar red green blue (sRGB, clipped), float opacity. `colors` is the matching
/// space of the volume. Returns the number of voxels written. Atomic; throws IoError.
std::int64_t write_voxels_ply(const std::filesystem::path& path, const Volume& volume,
                              const ColorTransform& colors, float opacity_threshold,
                              float confidence_threshold);

}  // namespace roxel

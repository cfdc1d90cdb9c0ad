#pragma once
/// A volume on disc: RUN/volume.vdb, OpenVDB grids that other programs open as a fog volume, and all that
/// later commands need to go on without loss. docs/format.md lists grids and metadata.

#include <filesystem>
#include <string>

#include "roxel/color/color_space.h"
#include "roxel/volume/volume.h"

namespace roxel {

/// What the numbers of a volume mean, and where they come from.
struct VolumeInfo {
  ColorTransform colors;     ///< the matching space that the colour channels are in
  double exposure = 1;       ///< linear RGB in the volume times this is radiance in the data set's unit; > 0
  std::string dataset = {};  ///< path of the data set, UTF-8
};

struct VolumeFile {
  Volume volume;
  VolumeInfo info;
};

/// Which lattices of a volume go into a file.
enum class SavedLattices { kBoxOnly, kAll };

/// Writes `path` under a temporary name and renames it. Reading it back gives the same channels bit for bit.
/// Throws IoError. Needs about 36 KiB of memory a brick while it writes.
void write_volume(const std::filesystem::path& path, const Volume& volume, const VolumeInfo& info,
                  SavedLattices lattices = SavedLattices::kBoxOnly);

/// Throws InvalidInput, naming the file, when it is missing, cut off, not OpenVDB, or not a volume of roxel.
VolumeFile read_volume(const std::filesystem::path& path);

}  // namespace roxel

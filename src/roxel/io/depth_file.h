#pragma once
/// RUN/depth/NAME.exr: the depth of one image, how sure it is, and how opaque its rays are.

#include <filesystem>
#include <string>

#include "roxel/depth/depth_layers.h"
#include "roxel/io/image_file.h"

namespace roxel {

/// RUN/depth/NAME.exr for the name of a view (without suffix), which may contain folders; "." and ".." in it
/// are dropped, so that the file is never outside RUN/depth.
std::filesystem::path depth_path(const std::filesystem::path& run, const std::string& view_name);

/// Writes 32-bit float EXR with channels Z, V, A, and Z.bp, V.bp, Z.refined, V.refined, N.x, N.y, N.z where
/// present. Makes missing folders. Atomic; throws IoError.
void write_depth(const std::filesystem::path& path, const DepthLayers& layers,
                 ExrCompression compression = ExrCompression::kRunLength);

/// Throws InvalidInput, naming the file, when it is missing, cut off, or without the channels Z, V, A.
DepthLayers read_depth(const std::filesystem::path& path);

}  // namespace roxel

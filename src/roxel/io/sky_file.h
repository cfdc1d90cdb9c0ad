#pragma once
/// RUN/sky: the light of each node, as `roxel sky` leaves it and later commands read it (docs/format.md).

#include <filesystem>
#include <string>
#include <vector>

#include "roxel/sky/node_sky.h"

namespace roxel {

/// RUN/sky/NODE.json; ".exr", "_nosun.exr" and pictures stand beside it.
std::filesystem::path sky_path(const std::filesystem::path& run, const std::string& node,
                               const std::string& suffix = ".json");
/// RUN/sky/mask/NAME.png for the name of a view (without suffix), which may contain folders; "." and ".." in
/// it are dropped. 255 is surely sky, 0 surely not.
std::filesystem::path sky_mask_path(const std::filesystem::path& run, const std::string& view_name);

/// NODE.json, NODE.exr (radiance with the sun's disc) and NODE_nosun.exr. Atomic; throws IoError.
void write_sky(const std::filesystem::path& run, const NodeSky& sky);

/// All that write_sky kept, exactly. Throws InvalidInput naming file and field.
NodeSky read_sky(const std::filesystem::path& json_file);

/// Every NODE.json of a run, by name. Throws InvalidInput where RUN/sky has none, or two say they are the
/// same node.
std::vector<NodeSky> read_skies(const std::filesystem::path& run);

}  // namespace roxel

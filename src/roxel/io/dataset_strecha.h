#pragma once
/// Strecha's outdoor benchmark [Strecha08]: a file IMAGE.camera for every image, with K (3 rows), a row of
/// three zeros, R (3 rows, camera-to-world), the centre C, and width height. x = K R^T (X - C).
/// The benchmark does not say where pixel centres lie; its principal points scale with the image (half size,
/// half value), so the corner of the image is taken as origin, as in roxel: nothing is added.

#include <filesystem>
#include <vector>

#include "roxel/dataset/dataset.h"

namespace roxel {

/// The *.camera files in `path`/cameras or `path`, sorted by name.
std::vector<std::filesystem::path> find_strecha(const std::filesystem::path& path);

/// Views without masks and nodes (read_dataset adds them). Images: `path`/images/IMAGE, or IMAGE beside.
Dataset read_strecha(const std::filesystem::path& path);

}  // namespace roxel

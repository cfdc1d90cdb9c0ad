#pragma once
/// Middlebury multi-view stereo [Seitz06]: NAME_par.txt holds the number of images, then a line each:
/// file, K (9, by rows), R (9), t (3), with pixel ~ K (R x + t). Pixel centres lie at integers there, so half
/// a pixel is added to cx and cy.

#include <filesystem>

#include "roxel/dataset/dataset.h"

namespace roxel {

/// The *_par.txt in `path`; empty where there is none. Throws InvalidInput where there are several.
std::filesystem::path find_middlebury(const std::filesystem::path& path);

/// Views without size, masks and nodes (read_dataset adds them); images lie beside the file or in images/.
Dataset read_middlebury(const std::filesystem::path& path);

}  // namespace roxel

#pragma once
/// Images that a stage puts aside and soon takes back: plain floats on disc, read and written as fast as the
/// disc is. No format for others.

#include <filesystem>
#include <vector>

#include "roxel/image/image.h"

namespace roxel {

/// Any images, empty ones too. Atomic, makes missing folders; throws IoError.
void write_kept_images(const std::filesystem::path& path, const std::vector<const Image*>& images);

/// The same images. Throws IoError, naming the file, where it is missing or cut off.
std::vector<Image> read_kept_images(const std::filesystem::path& path);

}  // namespace roxel

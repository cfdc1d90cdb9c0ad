#pragma once
/// What can be said about an image file without decoding its pixels.

#include <filesystem>
#include <string>

namespace roxel {

/// What the header says.
struct ImageSize {
  int width = 0;
  int height = 0;
  bool has_alpha = false;  ///< the file has a channel that says so
};

/// Size from the file's header. Throws InvalidInput, naming the file and `source` (who refers to it), where
/// it is missing, has 0 bytes, is no image, or (PNG, JPEG) stops before its end.
ImageSize checked_image_size(const std::filesystem::path& file, const std::string& source);

/// Whether a PNG's chunks or a JPEG's data reach their end mark; true for every other kind of file.
bool reaches_end_mark(const std::filesystem::path& file);

}  // namespace roxel

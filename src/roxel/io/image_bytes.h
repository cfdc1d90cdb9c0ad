#pragma once
/// Pictures as the bytes of an image file, for pages that hold their pictures themselves.

#include <string>

#include "roxel/image/image.h"

namespace roxel {

/// Of PNG files: of zlib's 1 to 9. Its default, 6, takes several times as long for files that are a few per
/// cent smaller.
inline constexpr int kPngCompression = 2;

/// Display values in [0, 1] as they are, 3 channels, as JPEG; quality 1 to 100. Throws IoError.
std::string jpeg_bytes(const Image& picture, int quality = 80);

/// 8-bit PNG of 1 or 3 channels, display values in [0, 1] as they are. Throws IoError.
std::string png_bytes(const Image& picture);

}  // namespace roxel

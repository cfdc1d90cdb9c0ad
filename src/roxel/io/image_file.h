#pragma once
/// Image files <-> pixels in memory: whatever OpenImageIO reads (PNG, JPEG, TIFF, EXR, HDR, ...); PNG and EXR
/// are written, each under a temporary name that is renamed when complete.
///
/// Pixels are taken as they are stored: an EXIF orientation is ignored, because calibrations speak of stored
/// pixels. Readers throw InvalidInput, naming the path, what was found and what was expected, when the file
/// is missing, empty, a folder, truncated, damaged or no image; writers throw IoError. All are thread safe
/// and silent on stderr.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "roxel/color/response.h"
#include "roxel/image/image.h"
#include "roxel/io/dataset_images.h"

namespace roxel {

/// Size from the header alone, for a file that is whole as far as can be told without decoding it.
ImageSize image_size(const std::string& path);

/// A photograph as its file has it, before the lens is undone.
struct ImageFile {
  Image rgb;   ///< linear RGB, 3 channels; grey is expanded
  Mask alpha;  ///< stored alpha, 0 to 255; empty where the file has none
  Mask valid;  ///< 0 where a channel is NaN or infinite (rgb is 0 there); empty = all valid
  std::int64_t invalid_pixels = 0;  ///< number of zeros in `valid`
  Response response;                ///< what was decoded with
};

/// Integer pixels are decoded from sRGB and float pixels taken as linear, unless `response` says otherwise.
/// Colour is not multiplied by alpha; where the file stores it multiplied (EXR), it is divided again. In
/// files of many channels R, G, B (of any layer, the first that has all three) are the colour. A file without
/// a single finite pixel is an error.
ImageFile read_image(const std::string& path, const std::optional<Response>& response = std::nullopt);

/// Stored values, 0 to 255 (float files: 0 to 1): alpha where that is not 255 everywhere, else grey, else the
/// largest of R, G, B. An 8-bit mask whose largest value is 1 is read as 0 and 255.
Mask read_mask(const std::string& path);

/// 8 bits a channel, 1 or 3 channels, light encoded by `response`.
void write_png(const std::string& path, const Image& image, const Response& response = {});
/// 8-bit grey, values as they are.
void write_png(const std::string& path, const Mask& mask);

/// One named plane of an EXR file: 1 channel, any float values.
struct FloatChannel {
  std::string name;  ///< "Z"; a dot makes a layer: "Z.bp" is the channel "bp" of the layer "Z"
  Image plane;
};

/// How a plane's numbers are kept: 24 significant bits, or 11 and a magnitude up to 65504 (what is above
/// becomes that).
enum class ExrPrecision { kFloat, kHalf };

/// What a file gains by it, and what it costs. Of depth maps, whose last bits are noise,
/// run lengths leave a fifth more and take far less time. kNone is for files that are soon read again and go,
/// or are written anew.
enum class ExrCompression { kZip, kRunLength, kNone };

/// All planes of one size, at least one; names are unique.
void write_exr(const std::string& path, const std::vector<FloatChannel>& channels,
               ExrPrecision precision = ExrPrecision::kFloat,
               ExrCompression compression = ExrCompression::kZip);

/// The channels R, G, B of an image of three.
std::vector<FloatChannel> rgb_channels(const Image& rgb);

/// Every channel of an EXR (or any float) file, unchanged (NaN included), in the file's order.
std::vector<FloatChannel> read_exr_channels(const std::string& path);

/// The channel of that name, or null.
const Image* find_channel(const std::vector<FloatChannel>& channels, const std::string& name);

}  // namespace roxel

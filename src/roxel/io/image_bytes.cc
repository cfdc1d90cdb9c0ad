#include "roxel/io/image_bytes.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>

#include "roxel/base/error.h"

namespace roxel {
namespace {

std::vector<std::uint8_t> bytes_of(const Image& picture) {
  std::vector<std::uint8_t> bytes(picture.data().size());
  std::transform(picture.data().begin(), picture.data().end(), bytes.begin(), [](float value) {
    return value > 0 ? static_cast<std::uint8_t>(std::lround(255 * std::min(value, 1.0f))) : std::uint8_t{0};
  });
  return bytes;
}

std::string encoded(const Image& picture, const char* format, const OIIO::ImageSpec& spec) {
  std::vector<unsigned char> file;
  OIIO::Filesystem::IOVecOutput memory(file);
  const auto out = OIIO::ImageOutput::create(format);
  if (!out || !out->supports("ioproxy"))
    throw IoError(std::string("cannot write ") + format + " to memory (" + OIIO::geterror() + ")");
  out->threads(1);
  out->set_ioproxy(&memory);
  const std::vector<std::uint8_t> bytes = bytes_of(picture);
  const bool written = out->open(std::string("memory.") + format, spec) &&
                       out->write_image(OIIO::TypeUInt8, bytes.data()) && out->close();
  if (!written) throw IoError(std::string("cannot write ") + format + ": " + out->geterror());
  return {file.begin(), file.end()};
}

}  // namespace

std::string jpeg_bytes(const Image& picture, int quality) {
  ROXEL_CHECK_EQ(picture.channels(), 3);
  OIIO::ImageSpec spec(picture.width(), picture.height(), 3, OIIO::TypeUInt8);
  spec.attribute("Compression", "jpeg:" + std::to_string(quality));
  return encoded(picture, "jpeg", spec);
}

std::string png_bytes(const Image& picture) {
  ROXEL_CHECK(picture.channels() == 1 || picture.channels() == 3);
  OIIO::ImageSpec spec(picture.width(), picture.height(), picture.channels(), OIIO::TypeUInt8);
  spec.attribute("png:compressionLevel", kPngCompression);
  return encoded(picture, "png", spec);
}

}  // namespace roxel

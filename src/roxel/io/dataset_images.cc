#include "roxel/io/dataset_images.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>

#include "roxel/base/error.h"
#include "roxel/io/dataset_text.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPngSignature("\x89PNG\r\n\x1a\n", 8);
constexpr std::string_view kJpegSignature("\xff\xd8\xff", 3);

/// Chunks are: uint32 length (big-endian) | type (4 bytes) | data | uint32 CRC; the last has type IEND.
bool png_reaches_end(std::ifstream& in, std::uint64_t size) {
  std::uint64_t at = kPngSignature.size();
  while (at + 12 <= size) {
    std::array<char, 8> head{};
    in.seekg(static_cast<std::streamoff>(at));
    if (!in.read(head.data(), head.size())) return false;
    std::uint64_t length = 0;
    for (int i = 0; i < 4; ++i) length = length << 8 | static_cast<unsigned char>(head[i]);
    at += 12 + length;
    if (std::string_view(head.data() + 4, 4) == "IEND") return at <= size;
  }
  return false;
}

/// The end-of-image marker FF D9 stands at the end; some cameras pad the file after it.
bool jpeg_reaches_end(std::ifstream& in, std::uint64_t size) {
  constexpr std::uint64_t kTail = 1 << 16;
  const std::uint64_t tail = std::min(size, kTail);
  std::string bytes(tail, '\0');
  in.seekg(static_cast<std::streamoff>(size - tail));
  if (!in.read(bytes.data(), static_cast<std::streamsize>(tail))) return false;
  return bytes.rfind("\xff\xd9") != std::string::npos;
}

std::string referred(const std::string& source) { return source.empty() ? "" : " (named in " + source + ")"; }

}  // namespace

bool reaches_end_mark(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::array<char, 8> head{};
  in.read(head.data(), head.size());
  const std::string_view start(head.data(), static_cast<std::size_t>(in.gcount()));
  in.clear();
  const std::uint64_t size = fs::file_size(file);
  if (start.starts_with(kPngSignature)) return png_reaches_end(in, size);
  if (start.starts_with(kJpegSignature)) return jpeg_reaches_end(in, size);
  return true;
}

ImageSize checked_image_size(const fs::path& file, const std::string& source) {
  const std::string where = file.string() + referred(source);
  if (!fs::exists(file)) throw_invalid(where, "no such file", "an image");
  if (!fs::is_regular_file(file)) throw_invalid(where, "not a plain file", "an image");
  if (fs::file_size(file) == 0) throw_invalid(where, "0 bytes", "an image");
  const std::unique_ptr<OIIO::ImageInput> in = OIIO::ImageInput::open(file.string());
  if (!in) {
    const std::string reason = OIIO::geterror();
    throw_invalid(where, "a file that cannot be read as an image (" + escaped(reason, 200) + ")",
                  "an image that OpenImageIO reads");
  }
  const ImageSize size{in->spec().width, in->spec().height, in->spec().alpha_channel >= 0};
  in->close();
  if (!reaches_end_mark(file)) {
    throw_invalid(where,
                  "an image that stops after " + std::to_string(fs::file_size(file)) + " bytes (truncated)",
                  "a complete file");
  }
  return size;
}

}  // namespace roxel

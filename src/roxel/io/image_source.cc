#include "roxel/io/image_source.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string_view>

#include "roxel/base/error.h"

namespace roxel::internal {
namespace {

constexpr const char* kExpected = "an image file (PNG, JPEG, TIFF, EXR, HDR, ...)";
constexpr std::int64_t kLargestPixelCount = std::int64_t{1} << 30;

/// Without a line's end, so that it can stand inside a sentence.
std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
  return text.empty() ? "no reason given" : text;
}

void check_is_file(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (!fs::exists(status)) throw_invalid(path, "no such file", kExpected);
  if (fs::is_directory(status)) throw_invalid(path, "a folder", kExpected);
  if (!fs::is_regular_file(status)) throw_invalid(path, "not a plain file", kExpected);
  if (fs::file_size(path, ignored) == 0) throw_invalid(path, "0 bytes", kExpected);
  const std::string damage = png_damage(path);
  if (!damage.empty()) throw_invalid(path, "a damaged PNG (" + damage + ")", "a complete file");
}

std::unique_ptr<OIIO::ImageInput> open(const std::string& path) {
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;  // leave colours as they are stored
  auto in = OIIO::ImageInput::open(path, &config);
  const std::string reason = OIIO::geterror();  // always taken: what is left is printed when the program ends
  if (!in) throw_invalid(path, "no image that can be read (" + one_line(reason) + ")", kExpected);
  in->threads(1);  // callers read many images at once
  return in;
}

void check_spec(const std::string& path, const OIIO::ImageSpec& spec) {
  const std::string size = std::to_string(spec.width) + " x " + std::to_string(spec.height);
  if (spec.width <= 0 || spec.height <= 0 || spec.depth > 1 || spec.nchannels <= 0 || spec.deep)
    throw_invalid(path, "a deep, volumetric or empty image of " + size + " pixels", "a flat image");
  if (std::int64_t{spec.width} * spec.height > kLargestPixelCount)
    throw_invalid(path, "an image of " + size + " pixels", "at most 2^30 pixels");
}

/// Renderers may store a part of the picture only; its pixel coordinates would then not be the camera's.
void check_window(const std::string& path, const OIIO::ImageSpec& spec) {
  if (spec.full_width == spec.width && spec.full_height == spec.height) return;
  const auto size = [](int w, int h) { return std::to_string(w) + " x " + std::to_string(h); };
  throw_invalid(path, "a data window of " + size(spec.width, spec.height) + " pixels",
                "the whole display window of " + size(spec.full_width, spec.full_height));
}

/// libjpeg goes on after damage and fills with grey; OpenImageIO keeps what it said. Some of that is
/// harmless.
bool harmless(std::string_view message) {
  for (const char* note : {"extraneous bytes", "JFIF revision", "Adobe color transform"})
    if (message.find(note) != std::string_view::npos) return true;
  return message.empty();
}

void check_messages(const std::string& path, const std::string& messages) {
  for (std::size_t begin = 0; begin < messages.size();) {
    const std::size_t end = std::min(messages.find('\n', begin), messages.size());
    const std::string message = messages.substr(begin, end - begin);
    if (!harmless(message))
      throw_invalid(path, "a truncated or damaged image (" + one_line(message) + ")", "a complete file");
    begin = end + 1;
  }
}

SampleKind sample_kind(const OIIO::TypeDesc& type) {
  if (type.is_floating_point()) return SampleKind::kFloat;
  if (type.basetype == OIIO::TypeDesc::UINT8) return SampleKind::kByte;
  if (type.basetype == OIIO::TypeDesc::UINT16) return SampleKind::kShort;
  return SampleKind::kOther;
}

std::array<std::uint32_t, 256> crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    table[i] = i;
    for (int bit = 0; bit < 8; ++bit) table[i] = table[i] & 1 ? 0xedb88320u ^ (table[i] >> 1) : table[i] >> 1;
  }
  return table;
}

/// CRC-32 of PNG (ISO 3309) over type and data of a chunk.
std::uint32_t crc32(std::string_view bytes) {
  static const std::array<std::uint32_t, 256> table = crc_table();
  std::uint32_t crc = 0xffffffffu;
  for (const char byte : bytes) crc = table[(crc ^ static_cast<unsigned char>(byte)) & 0xff] ^ (crc >> 8);
  return ~crc;
}

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char byte : bytes.substr(0, 4)) value = value << 8 | static_cast<unsigned char>(byte);
  return value;
}

std::string file_bytes(std::ifstream& in) {
  in.seekg(0, std::ios::end);
  std::string bytes(static_cast<std::size_t>(in.tellg()), '\0');
  in.seekg(0);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return bytes;
}

}  // namespace

std::string png_damage(const std::string& path) {
  constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);
  std::ifstream in(path, std::ios::binary);
  std::array<char, kSignature.size()> start{};
  in.read(start.data(), start.size());
  if (std::string_view(start.data(), static_cast<std::size_t>(in.gcount())) != kSignature) return "";
  const std::string bytes = file_bytes(in);
  const std::string_view all(bytes);
  // Chunks are: uint32 length (big-endian) | type (4 bytes) | data | uint32 CRC; the last has type IEND.
  for (std::size_t at = kSignature.size(); at + 12 <= all.size();) {
    const std::size_t length = big_endian(all.substr(at));
    const std::string_view type = all.substr(at + 4, 4);
    if (length > all.size() - at - 12) break;
    if (crc32(all.substr(at + 4, 4 + length)) != big_endian(all.substr(at + 8 + length)))
      return "wrong checksum of a chunk at byte " + std::to_string(at);
    if (type == "IEND") return "";
    at += 12 + length;
  }
  return "it stops after " + std::to_string(all.size()) + " bytes, before its end mark";
}

ImageSource read_image_source(const std::string& path) {
  check_is_file(path);
  const auto in = open(path);
  const OIIO::ImageSpec& spec = in->spec();
  check_spec(path, spec);
  check_window(path, spec);
  ImageSource source;
  source.path = path;
  source.width = spec.width;
  source.height = spec.height;
  source.channel_names = spec.channelnames;
  source.alpha_channel = spec.alpha_channel;
  source.alpha_multiplied = spec.alpha_channel >= 0 && spec.get_int_attribute("oiio:UnassociatedAlpha") == 0;
  source.kind = sample_kind(spec.format);
  source.values.resize(source.pixels() * source.channels());
  const bool whole = in->read_image(0, 0, 0, source.channels(), OIIO::TypeFloat, source.values.data());
  const std::string messages = in->geterror();
  if (!whole)
    throw_invalid(path, "a truncated or damaged image (" + one_line(messages) + ")", "a complete file");
  check_messages(path, messages);
  return source;
}

}  // namespace roxel::internal

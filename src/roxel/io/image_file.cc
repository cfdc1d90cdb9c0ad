#include "roxel/io/image_file.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <set>
#include <utility>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/io/image_bytes.h"
#include "roxel/io/image_source.h"

namespace roxel {
namespace {

using internal::ImageSource;
using internal::SampleKind;

/// The channel named `name`, or `name` in the layer "layer."; -1 where there is none.
int channel_index(const ImageSource& source, const std::string& name) {
  const auto& names = source.channel_names;
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

/// Red, green and blue: of the main layer, else of the first layer that has them, else the first three
/// channels, else the first one for all.
std::array<int, 3> color_channels(const ImageSource& source) {
  std::vector<std::string> layers{""};
  for (const std::string& name : source.channel_names)
    if (name.ends_with(".R")) layers.push_back(name.substr(0, name.size() - 1));
  for (const std::string& layer : layers) {
    const std::array<int, 3> rgb{channel_index(source, layer + "R"), channel_index(source, layer + "G"),
                                 channel_index(source, layer + "B")};
    if (std::ranges::all_of(rgb, [](int c) { return c >= 0; })) return rgb;
  }
  const int color_count = source.channels() - (source.alpha_channel >= 0 ? 1 : 0);
  if (color_count >= 3) return {0, 1, 2};
  return {0, 0, 0};
}

std::uint8_t byte_of(float value) {
  // Not a number fails the comparison.
  return value > 0 ? static_cast<std::uint8_t>(std::lround(255 * std::min(value, 1.0f))) : 0;
}

/// Light of stored values: a table where there are only so many of them.
class Decoder {
 public:
  Decoder(const Response& response, SampleKind kind) : response_(response) {
    if (response.curve == ResponseCurve::kLinear) return;
    if (kind == SampleKind::kByte) table_ = decoding_table(response, 256);
    if (kind == SampleKind::kShort) table_ = decoding_table(response, 65536);
  }

  float operator()(float stored) const {
    if (table_.empty()) return decode(response_, stored);
    const auto level = std::lround(stored * static_cast<float>(table_.size() - 1));
    return table_[std::clamp<long>(level, 0, static_cast<long>(table_.size()) - 1)];
  }

 private:
  Response response_;
  std::vector<float> table_;
};

/// Divides colours that are stored times alpha. Where alpha is 0 nothing is known but the product (light that
/// a transparent thing emits), which stays.
void divide_by_alpha(ImageSource& source, const std::array<int, 3>& rgb) {
  if (!source.alpha_multiplied) return;
  const std::set<int> colors(rgb.begin(), rgb.end());
  for (std::size_t p = 0; p < source.pixels(); ++p) {
    float* pixel = source.values.data() + p * source.channels();
    const float alpha = pixel[source.alpha_channel];
    if (!(alpha > 0) || alpha >= 1) continue;
    for (const int c : colors) pixel[c] /= alpha;
  }
  source.kind = source.kind == SampleKind::kFloat ? SampleKind::kFloat : SampleKind::kOther;
}

Mask channel_as_mask(const ImageSource& source, int channel) {
  Mask mask(source.width, source.height);
  for (std::size_t p = 0; p < source.pixels(); ++p)
    mask.data()[p] = byte_of(source.values[p * source.channels() + channel]);
  return mask;
}

void decode_pixels(const ImageSource& source, const std::array<int, 3>& rgb, ImageFile& file) {
  const Decoder decoder(file.response, source.kind);
  file.rgb = Image(source.width, source.height, 3);
  for (std::size_t p = 0; p < source.pixels(); ++p) {
    const float* stored = source.values.data() + p * source.channels();
    float* light = file.rgb.data().data() + 3 * p;
    for (int c = 0; c < 3; ++c) light[c] = decoder(stored[rgb[c]]);
    if (std::isfinite(light[0]) && std::isfinite(light[1]) && std::isfinite(light[2])) continue;
    if (file.valid.empty()) file.valid = Mask(source.width, source.height, 255);
    file.valid.data()[p] = 0;
    std::fill_n(light, 3, 0.0f);
    ++file.invalid_pixels;
  }
}

/// A file for OpenImageIO to write to. Its own files are closed without a look at whether the last bytes
/// found room, and a full disc would leave a file cut short that nobody complained of.
class CheckedFile {
 public:
  CheckedFile(const std::string& name, const std::filesystem::path& path)
      : name_(name), file_(std::fopen(path.c_str(), "wb")) {
    if (!file_) fail();
  }
  ~CheckedFile() {
    if (file_) std::fclose(file_);
  }
  CheckedFile(const CheckedFile&) = delete;
  CheckedFile& operator=(const CheckedFile&) = delete;

  std::FILE* handle() const { return file_; }

  /// Throws IoError where not all that was written is in the file.
  void close() {
    const bool written = std::ferror(file_) == 0;
    const bool closed = std::fclose(std::exchange(file_, nullptr)) == 0;
    if (!written || !closed) fail();
  }

 private:
  [[noreturn]] void fail() const {
    throw IoError(name_ + ": cannot write (disc full, or no permission?): " + std::strerror(errno));
  }

  std::string name_;
  std::FILE* file_;
};

/// Writes `values` of the spec's shape as the given format; `type` is that of the values in memory.
void write_with(const std::string& path, const char* format, const OIIO::ImageSpec& spec, OIIO::TypeDesc type,
                const void* values) {
  write_file_atomically(path, [&](const std::filesystem::path& temporary) {
    CheckedFile file(path, temporary);
    OIIO::Filesystem::IOFile proxy(file.handle(), OIIO::Filesystem::IOProxy::Write);
    const auto out = OIIO::ImageOutput::create(format, &proxy);
    const std::string reason = OIIO::geterror();
    if (!out || !out->supports("ioproxy")) throw IoError(path + ": cannot write " + format + ": " + reason);
    out->threads(1);
    const bool written =
        out->open(temporary.string(), spec) && out->write_image(type, values) && out->close();
    if (!written) throw IoError(path + ": cannot write (disc full?): " + out->geterror());
    file.close();
  });
}

void write_png_bytes(const std::string& path, int width, int height, int channels,
                     const std::vector<std::uint8_t>& bytes) {
  OIIO::ImageSpec spec(width, height, channels, OIIO::TypeUInt8);
  spec.attribute("png:compressionLevel", kPngCompression);
  write_with(path, "png", spec, OIIO::TypeUInt8, bytes.data());
}

const char* name_of(ExrCompression compression) {
  switch (compression) {
    case ExrCompression::kZip:
      return "zip:2";
    case ExrCompression::kRunLength:
      return "rle";
    case ExrCompression::kNone:
      return "none";
  }
  return "";
}

}  // namespace

ImageSize image_size(const std::string& path) { return checked_image_size(path, ""); }

ImageFile read_image(const std::string& path, const std::optional<Response>& response) {
  ImageSource source = internal::read_image_source(path);
  const std::array<int, 3> rgb = color_channels(source);
  ImageFile file;
  file.response = response.value_or(
      Response{source.kind == SampleKind::kFloat ? ResponseCurve::kLinear : ResponseCurve::kSrgb});
  if (source.alpha_channel >= 0) file.alpha = channel_as_mask(source, source.alpha_channel);
  divide_by_alpha(source, rgb);
  decode_pixels(source, rgb, file);
  if (file.invalid_pixels == static_cast<std::int64_t>(source.pixels()))
    throw_invalid(path, "NaN or infinity in every pixel", "finite pixels");
  return file;
}

Mask read_mask(const std::string& path) {
  ImageSource source = internal::read_image_source(path);
  const std::array<int, 3> rgb = color_channels(source);
  if (source.alpha_channel >= 0) {
    const Mask alpha = channel_as_mask(source, source.alpha_channel);
    if (std::ranges::any_of(alpha.data(), [](std::uint8_t a) { return a != 255; })) return alpha;
  }
  Mask mask(source.width, source.height);
  std::uint8_t largest = 0;
  for (std::size_t p = 0; p < source.pixels(); ++p) {
    const float* stored = source.values.data() + p * source.channels();
    mask.data()[p] = std::max({byte_of(stored[rgb[0]]), byte_of(stored[rgb[1]]), byte_of(stored[rgb[2]])});
    largest = std::max(largest, mask.data()[p]);
  }
  if (source.kind == SampleKind::kByte && largest == 1)
    for (std::uint8_t& value : mask.data()) value *= 255;
  return mask;
}

void write_png(const std::string& path, const Image& image, const Response& response) {
  ROXEL_CHECK(image.channels() == 1 || image.channels() == 3);
  std::vector<std::uint8_t> bytes(image.data().size());
  std::ranges::transform(image.data(), bytes.begin(),
                         [&](float light) { return encode_8bit(response, light); });
  write_png_bytes(path, image.width(), image.height(), image.channels(), bytes);
}

void write_png(const std::string& path, const Mask& mask) {
  write_png_bytes(path, mask.width(), mask.height(), 1, mask.data());
}

std::vector<FloatChannel> rgb_channels(const Image& rgb) {
  ROXEL_CHECK_EQ(rgb.channels(), 3);
  std::vector<FloatChannel> channels;
  for (int c = 0; c < 3; ++c) {
    channels.push_back({std::string(1, "RGB"[c]), Image(rgb.width(), rgb.height(), 1)});
    std::vector<float>& plane = channels.back().plane.data();
    for (std::size_t p = 0; p < plane.size(); ++p) plane[p] = rgb.data()[3 * p + c];
  }
  return channels;
}

void write_exr(const std::string& path, const std::vector<FloatChannel>& channels, ExrPrecision precision,
               ExrCompression compression) {
  ROXEL_CHECK(!channels.empty());
  const Image& first = channels.front().plane;
  const std::size_t count = channels.size();
  const bool half = precision == ExrPrecision::kHalf;
  OIIO::ImageSpec spec(first.width(), first.height(), static_cast<int>(count),
                       half ? OIIO::TypeHalf : OIIO::TypeFloat);
  std::vector<float> values(first.data().size() * count);
  std::set<std::string> names;
  for (std::size_t c = 0; c < count; ++c) {
    const Image& plane = channels[c].plane;
    ROXEL_CHECK_EQ(plane.channels(), 1);
    ROXEL_CHECK_EQ(plane.width(), first.width());
    ROXEL_CHECK_EQ(plane.height(), first.height());
    ROXEL_CHECK(names.insert(channels[c].name).second);
    spec.channelnames[c] = channels[c].name;
    for (std::size_t p = 0; p < plane.data().size(); ++p) values[p * count + c] = plane.data()[p];
  }
  constexpr float kLargestHalf = 65504;
  if (half)
    for (float& value : values) value = std::clamp(value, -kLargestHalf, kLargestHalf);
  spec.alpha_channel = -1;  // planes are numbers, not colours: nothing is multiplied by a plane called A
  spec.z_channel = -1;
  spec.attribute("compression", name_of(compression));
  spec.attribute("DateTime", "1970:01:01 00:00:00");  // else it is now, and equal pixels make unequal files
  write_with(path, "openexr", spec, OIIO::TypeFloat, values.data());
}

std::vector<FloatChannel> read_exr_channels(const std::string& path) {
  const ImageSource source = internal::read_image_source(path);
  if (source.kind != SampleKind::kFloat) throw_invalid(path, "an image of integers", "an EXR file of floats");
  std::vector<FloatChannel> channels;
  for (int c = 0; c < source.channels(); ++c) {
    channels.push_back({source.channel_names[c], Image(source.width, source.height, 1)});
    std::vector<float>& plane = channels.back().plane.data();
    for (std::size_t p = 0; p < plane.size(); ++p) plane[p] = source.values[p * source.channels() + c];
  }
  return channels;
}

const Image* find_channel(const std::vector<FloatChannel>& channels, const std::string& name) {
  const auto found = std::ranges::find(channels, name, &FloatChannel::name);
  return found == channels.end() ? nullptr : &found->plane;
}

}  // namespace roxel

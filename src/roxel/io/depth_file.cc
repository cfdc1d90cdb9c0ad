#include "roxel/io/depth_file.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"

namespace roxel {
namespace {

constexpr const char* kExpected = "an EXR file with float channels Z, V, A";

struct Channel {
  const char* name;
  Image DepthLayers::*image;
  bool required;
};
constexpr std::array<Channel, 5> kChannels{{{"Z", &DepthLayers::depth, true},
                                            {"V", &DepthLayers::variance, true},
                                            {"A", &DepthLayers::opacity, true},
                                            {"Z.bp", &DepthLayers::depth_bp, false},
                                            {"V.bp", &DepthLayers::variance_bp, false}}};

std::vector<Channel> channels_present(const DepthLayers& layers) {
  std::vector<Channel> present;
  for (const Channel& channel : kChannels) {
    const Image& image = layers.*channel.image;
    if (image.empty() && !channel.required) continue;
    ROXEL_CHECK_EQ(image.width(), layers.depth.width());
    ROXEL_CHECK_EQ(image.height(), layers.depth.height());
    ROXEL_CHECK_EQ(image.channels(), 1);
    present.push_back(channel);
  }
  return present;
}

OIIO::ImageSpec spec_of(const DepthLayers& layers, const std::vector<Channel>& channels) {
  OIIO::ImageSpec spec(layers.depth.width(), layers.depth.height(), static_cast<int>(channels.size()),
                       OIIO::TypeFloat);
  for (std::size_t c = 0; c < channels.size(); ++c) spec.channelnames[c] = channels[c].name;
  spec.alpha_channel = -1;  // A is the ray's opacity, and nothing is premultiplied by it
  spec.z_channel = -1;
  spec.attribute("compression", "zip");
  spec.attribute("oiio:ColorSpace", "Linear");
  return spec;
}

std::vector<float> interleaved(const DepthLayers& layers, const std::vector<Channel>& channels) {
  std::vector<float> pixels(layers.depth.data().size() * channels.size());
  for (std::size_t c = 0; c < channels.size(); ++c)
    for (std::size_t p = 0; p < layers.depth.data().size(); ++p)
      pixels[p * channels.size() + c] = (layers.*channels[c].image).data()[p];
  return pixels;
}

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& found) {
  throw_invalid(path.string(), found, kExpected);
}

}  // namespace

std::filesystem::path depth_path(const std::filesystem::path& run, const std::string& view_name) {
  std::filesystem::path path = run / "depth";
  for (const auto& part : std::filesystem::path(view_name).relative_path())
    if (part != "." && part != ".." && !part.empty()) path /= part;
  path += ".exr";  // not replace_extension: "frame.0001" keeps its dot
  return path;
}

void write_depth(const std::filesystem::path& path, const DepthLayers& layers) {
  const std::vector<Channel> channels = channels_present(layers);
  const std::vector<float> pixels = interleaved(layers, channels);
  write_file_atomically(path, [&](const std::filesystem::path& temporary) {
    const auto file = OIIO::ImageOutput::create(temporary.string());
    if (!file) throw IoError(path.string() + ": cannot write EXR: " + OIIO::geterror());
    const bool written = file->open(temporary.string(), spec_of(layers, channels)) &&
                         file->write_image(OIIO::TypeFloat, pixels.data()) && file->close();
    if (!written) throw IoError(path.string() + ": cannot write: " + file->geterror());
  });
}

DepthLayers read_depth(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) refuse(path, "no such file");
  const auto file = OIIO::ImageInput::open(path.string());
  if (!file) refuse(path, "an unreadable file (" + OIIO::geterror() + ")");
  const OIIO::ImageSpec& spec = file->spec();
  std::vector<float> pixels(static_cast<std::size_t>(spec.width) * spec.height * spec.nchannels);
  if (!file->read_image(0, 0, 0, spec.nchannels, OIIO::TypeFloat, pixels.data()))
    refuse(path, "a damaged file (" + file->geterror() + ")");
  DepthLayers layers;
  for (const Channel& channel : kChannels) {
    const auto at = std::find(spec.channelnames.begin(), spec.channelnames.end(), channel.name);
    if (at == spec.channelnames.end() && channel.required)
      refuse(path, std::string("no channel ") + channel.name);
    if (at == spec.channelnames.end()) continue;
    Image& image = layers.*channel.image = Image(spec.width, spec.height, 1);
    for (std::size_t p = 0; p < image.data().size(); ++p)
      image.data()[p] = pixels[p * spec.nchannels + (at - spec.channelnames.begin())];
  }
  return layers;
}

}  // namespace roxel

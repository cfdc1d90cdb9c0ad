#include "roxel/io/depth_file.h"

#include <array>
#include <vector>

#include "roxel/base/error.h"
#include "roxel/io/image_file.h"

namespace roxel {
namespace {

struct Channel {
  const char* name;
  Image DepthLayers::*image;
  bool required;
};
constexpr std::array<Channel, 7> kChannels{{{"Z", &DepthLayers::depth, true},
                                            {"V", &DepthLayers::variance, true},
                                            {"A", &DepthLayers::opacity, true},
                                            {"Z.bp", &DepthLayers::depth_bp, false},
                                            {"V.bp", &DepthLayers::variance_bp, false},
                                            {"Z.refined", &DepthLayers::depth_refined, false},
                                            {"V.refined", &DepthLayers::variance_refined, false}}};
constexpr std::array<const char*, 3> kNormal{"N.x", "N.y", "N.z"};

Image plane_of(const Image& image, int channel) {
  Image plane(image.width(), image.height(), 1);
  for (std::size_t i = 0; i < plane.data().size(); ++i)
    plane.data()[i] = image.data()[image.channels() * i + channel];
  return plane;
}

/// Empty unless all three are there.
Image read_normal(const std::vector<FloatChannel>& planes, const Image& depth) {
  Image normal(depth.width(), depth.height(), 3);
  for (int c = 0; c < 3; ++c) {
    const Image* plane = find_channel(planes, kNormal[c]);
    if (!plane) return {};
    for (std::size_t i = 0; i < plane->data().size(); ++i) normal.data()[3 * i + c] = plane->data()[i];
  }
  return normal;
}

}  // namespace

std::filesystem::path depth_path(const std::filesystem::path& run, const std::string& view_name) {
  std::filesystem::path path = run / "depth";
  for (const auto& part : std::filesystem::path(view_name).relative_path())
    if (part != "." && part != ".." && !part.empty()) path /= part;
  path += ".exr";  // not replace_extension: "frame.0001" keeps its dot
  return path;
}

void write_depth(const std::filesystem::path& path, const DepthLayers& layers, ExrCompression compression) {
  std::vector<FloatChannel> planes;
  for (const Channel& channel : kChannels) {
    const Image& image = layers.*channel.image;
    if (image.empty() && !channel.required) continue;
    ROXEL_CHECK_EQ(image.width(), layers.depth.width());
    ROXEL_CHECK_EQ(image.height(), layers.depth.height());
    ROXEL_CHECK_EQ(image.channels(), 1);
    planes.push_back({channel.name, image});
  }
  if (!layers.normal.empty()) {
    ROXEL_CHECK_EQ(layers.normal.width(), layers.depth.width());
    ROXEL_CHECK_EQ(layers.normal.height(), layers.depth.height());
    ROXEL_CHECK_EQ(layers.normal.channels(), 3);
    for (int c = 0; c < 3; ++c) planes.push_back({kNormal[c], plane_of(layers.normal, c)});
  }
  write_exr(path.string(), planes, ExrPrecision::kFloat, compression);
}

DepthLayers read_depth(const std::filesystem::path& path) {
  const std::vector<FloatChannel> planes = read_exr_channels(path.string());
  DepthLayers layers;
  for (const Channel& channel : kChannels) {
    const Image* plane = find_channel(planes, channel.name);
    if (plane) layers.*channel.image = *plane;
    if (!plane && channel.required)
      throw_invalid(path.string(), std::string("no channel ") + channel.name,
                    "an EXR file with float channels Z, V, A");
  }
  layers.normal = read_normal(planes, layers.depth);
  return layers;
}

}  // namespace roxel

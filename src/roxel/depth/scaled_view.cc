#include "roxel/depth/scaled_view.h"
#include "roxel/base/median.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace roxel {
namespace {

constexpr double kLeastVoxel = 1.5;  ///< pixels: what refinement was measured at on worlds with known depth
constexpr double kLeastPixels = 100e3;  ///< of a view that was made smaller
constexpr int kMostScale = 16;
constexpr int kDepthStride = 8;  ///< pixels between depths whose median is taken

}  // namespace

int choose_scale(std::vector<double> voxel_pixels, std::vector<double> view_pixels) {
  std::erase_if(voxel_pixels, [](double pixels) { return !(pixels > 0); });
  const double across = median(voxel_pixels), pixels = median(view_pixels);
  int scale = 1;
  for (int next = 2; next <= kMostScale; next *= 2)
    if (across / next >= kLeastVoxel && pixels / (next * next) >= kLeastPixels) scale = next;
  return scale;
}

std::vector<double> pixels_of_views(const Dataset& dataset) {
  std::vector<double> pixels;
  for (const View& view : dataset.views)
    pixels.push_back(static_cast<double>(view.camera.intrinsics.width) * view.camera.intrinsics.height);
  return pixels;
}

double voxel_in_pixels(const Image& depth, double focal_px, double voxel_size) {
  std::vector<double> depths;
  for (int y = kDepthStride / 2; y < depth.height(); y += kDepthStride)
    for (int x = kDepthStride / 2; x < depth.width(); x += kDepthStride)
      if (const float z = *depth.pixel(x, y); z > 0) depths.push_back(z);
  const double z = median(depths);
  return z > 0 ? focal_px * voxel_size / z : 0;
}

std::vector<std::int64_t> surest_pixels(const Image& depth, const Image& variance, int scale) {
  const int width = std::max(1, depth.width() / scale), height = std::max(1, depth.height() / scale);
  std::vector<std::int64_t> surest;
  surest.reserve(static_cast<std::size_t>(width) * height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      std::int64_t best = -1;
      float least = std::numeric_limits<float>::infinity();
      for (int v = y * scale; v < std::min((y + 1) * scale, depth.height()); ++v)
        for (int u = x * scale; u < std::min((x + 1) * scale, depth.width()); ++u) {
          if (!(*depth.pixel(u, v) > 0) || !(*variance.pixel(u, v) < least)) continue;
          least = *variance.pixel(u, v);
          best = static_cast<std::int64_t>(v) * depth.width() + u;
        }
      surest.push_back(best);
    }
  return surest;
}

PlaneOfPixel plane_of_pixel(const PlaneMap& planes, int scale, int x, int y, double depth) {
  const double u = (x + 0.5) / scale, v = (y + 0.5) / scale;
  PlaneOfPixel best;
  double least = std::numeric_limits<double>::infinity();
  const int left = scale == 1 ? x : static_cast<int>(std::floor(u - 0.5));
  const int top = scale == 1 ? y : static_cast<int>(std::floor(v - 0.5));
  const int more = scale == 1 ? 0 : 1;
  for (int row = std::clamp(top, 0, planes.height - 1); row <= std::min(top + more, planes.height - 1); ++row)
    for (int column = std::clamp(left, 0, planes.width - 1);
         column <= std::min(left + more, planes.width - 1); ++column) {
      const PixelPlane& from = planes.at(column, row);
      if (from.empty()) continue;
      const double w = from.w + from.wu * (u - (column + 0.5)) + from.wv * (v - (row + 0.5));
      const double off = w > 0 ? std::abs(1 / w - depth) : std::numeric_limits<double>::infinity();
      if (!(off < least)) continue;
      least = off;
      best = {
          {static_cast<float>(w), from.wu / static_cast<float>(scale), from.wv / static_cast<float>(scale)},
          column,
          row};
    }
  return best;
}

}  // namespace roxel

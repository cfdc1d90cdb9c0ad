#include "roxel/report/pictures.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using Color = std::array<float, 3>;

constexpr int kGap = 6;
constexpr float kSheetGrey = 0.12f;
constexpr float kNoSigmaGrey = 0.75f;

/// Far to near.
constexpr std::array<Color, 7> kDepthColors{{{0.13f, 0.14f, 0.36f},
                                             {0.31f, 0.18f, 0.55f},
                                             {0.58f, 0.20f, 0.56f},
                                             {0.84f, 0.29f, 0.42f},
                                             {0.96f, 0.49f, 0.26f},
                                             {0.99f, 0.75f, 0.35f},
                                             {1.00f, 0.96f, 0.72f}}};

/// None to kHottestError.
constexpr std::array<Color, 6> kHeatColors{{{0.00f, 0.00f, 0.00f},
                                            {0.25f, 0.05f, 0.40f},
                                            {0.70f, 0.12f, 0.30f},
                                            {0.95f, 0.40f, 0.10f},
                                            {1.00f, 0.80f, 0.25f},
                                            {1.00f, 1.00f, 1.00f}}};

constexpr Color kTooNear{0.13f, 0.30f, 0.70f};
constexpr Color kTooFar{0.75f, 0.10f, 0.10f};

template <std::size_t N>
Color blend(const std::array<Color, N>& colors, float position) {
  const float scaled = std::clamp(position, 0.0f, 1.0f) * (N - 1);
  const std::size_t i = std::min<std::size_t>(static_cast<std::size_t>(scaled), N - 2);
  const float share = scaled - static_cast<float>(i);
  Color color;
  for (int c = 0; c < 3; ++c) color[c] = colors[i][c] + share * (colors[i + 1][c] - colors[i][c]);
  return color;
}

bool has_depth(const Image& depth, const Image& opacity, int x, int y) {
  return *opacity.pixel(x, y) > 0.5f && *depth.pixel(x, y) > 0;
}

/// Brightness of the slope at a pixel, 1 where it faces the viewer; `scale` turns depth into pixels.
float slope_shade(const Image& depth, const Image& opacity, int x, int y, float scale) {
  const int left = std::max(x - 1, 0), right = std::min(x + 1, depth.width() - 1);
  const int above = std::max(y - 1, 0), below = std::min(y + 1, depth.height() - 1);
  for (const auto& [px, py] : {std::pair{left, y}, {right, y}, {x, above}, {x, below}})
    if (!has_depth(depth, opacity, px, py)) return 1;
  const float dx = scale * (*depth.pixel(right, y) - *depth.pixel(left, y));
  const float dy = scale * (*depth.pixel(x, below) - *depth.pixel(x, above));
  const float lit = (1 + 0.5f * (dx + dy)) / std::sqrt(1 + dx * dx + dy * dy);
  return std::clamp(0.55f + 0.45f * lit, 0.45f, 1.15f);
}

void paste(const Image& picture, int left, int top, Image& sheet) {
  for (int y = 0; y < picture.height(); ++y)
    std::copy_n(picture.pixel(0, y), 3 * picture.width(), sheet.pixel(left, top + y));
}

}  // namespace

Image encoded_picture(const Image& linear_rgb, double white, const Response& response) {
  Image picture = linear_rgb;
  const float scale = static_cast<float>(1 / white);
  for (float& value : picture.data()) {
    const float light = value * scale;
    value = std::isnan(light) ? 0 : encode(response, std::clamp(light, 0.0f, 1.0f));
  }
  return picture;
}

ShownDepths shown_depths(const Image& depth, const Image& opacity) {
  std::vector<float> depths;
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x)
      if (has_depth(depth, opacity, x, y)) depths.push_back(*depth.pixel(x, y));
  if (depths.empty()) return {};
  const auto percentile = [&](double share) {
    const auto nth = depths.begin() + static_cast<std::ptrdiff_t>(share * (depths.size() - 1));
    std::nth_element(depths.begin(), nth, depths.end());
    return *nth;
  };
  return {percentile(0.02), percentile(0.98)};
}

Image depth_picture(const Image& depth, const Image& opacity, const ShownDepths& shown) {
  Image picture(depth.width(), depth.height(), 3);
  const float range = shown.far - shown.near;
  const float inverse = range > 0 ? 1 / range : 0;
  // A slope of 45 degrees on screen: the range of depths over a fifth of the picture's width.
  const float scale = 0.2f * inverse * static_cast<float>(depth.width()) / 2;
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      const float z = *depth.pixel(x, y);
      if (!(z > 0)) continue;
      const Color color = blend(kDepthColors, 1 - (z - shown.near) * inverse);
      const float shade =
          slope_shade(depth, opacity, x, y, scale) * std::clamp(*opacity.pixel(x, y), 0.0f, 1.0f);
      for (int c = 0; c < 3; ++c) picture.pixel(x, y)[c] = std::min(1.0f, shade * color[c]);
    }
  return picture;
}

Image error_picture(const Image& render, const Image& photo, const Mask& valid, const Mask& foreground) {
  ROXEL_CHECK_EQ(render.width(), photo.width());
  ROXEL_CHECK_EQ(render.height(), photo.height());
  Image picture(render.width(), render.height(), 3);
  for (int y = 0; y < render.height(); ++y)
    for (int x = 0; x < render.width(); ++x) {
      if (!valid.empty() && valid.at(x, y) == 0) continue;
      const float shown = foreground.empty() || foreground.at(x, y) >= 128 ? 1.0f : 0.0f;
      float squared = 0;
      for (int c = 0; c < 3; ++c) {
        const float difference = render.pixel(x, y)[c] - shown * photo.pixel(x, y)[c];
        squared += difference * difference / 3;
      }
      const Color color = blend(kHeatColors, std::sqrt(squared) / kHottestError);
      std::copy(color.begin(), color.end(), picture.pixel(x, y));
    }
  return picture;
}

Image sigma_picture(const Image& variance, const Image& depth, const Image& opacity, double voxel_size) {
  Image picture(variance.width(), variance.height(), 3, kNoSigmaGrey);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) {
      if (!has_depth(depth, opacity, x, y)) continue;
      const float sigma = std::sqrt(std::max(0.0f, *variance.pixel(x, y))) / static_cast<float>(voxel_size);
      const Color color = blend(kHeatColors, sigma / kHottestSigma);
      std::copy(color.begin(), color.end(), picture.pixel(x, y));
    }
  return picture;
}

Image depth_error_picture(const Image& depth, const Image& opacity, const Image& truth, double voxel_size) {
  ROXEL_CHECK_EQ(depth.width(), truth.width());
  ROXEL_CHECK_EQ(depth.height(), truth.height());
  Image picture(depth.width(), depth.height(), 3, kNoSigmaGrey);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) {
      const bool found = has_depth(depth, opacity, x, y), true_surface = *truth.pixel(x, y) > 0;
      if (!found && !true_surface) continue;
      Color color{0, 0, 0};
      if (found && true_surface) {
        const float error = (*depth.pixel(x, y) - *truth.pixel(x, y)) / static_cast<float>(voxel_size);
        const float fade = std::min(std::abs(error) / kFullestDepthError, 1.0f);
        const Color& full = error < 0 ? kTooNear : kTooFar;
        for (int c = 0; c < 3; ++c) color[c] = 1 + fade * (full[c] - 1);
      }
      std::copy(color.begin(), color.end(), picture.pixel(x, y));
    }
  return picture;
}

Image thumbnail(const Image& picture, int width) {
  if (picture.width() <= width) return picture;
  const int height =
      std::max(1, static_cast<int>(std::lround(1.0 * picture.height() * width / picture.width())));
  Image small(width, height, 3);
  const auto first = [](int index, int count, int of) { return static_cast<int>(1LL * index * of / count); };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int x0 = first(x, width, picture.width()),
                x1 = std::max(x0 + 1, first(x + 1, width, picture.width()));
      const int y0 = first(y, height, picture.height()),
                y1 = std::max(y0 + 1, first(y + 1, height, picture.height()));
      for (int v = y0; v < y1; ++v)
        for (int u = x0; u < x1; ++u)
          for (int c = 0; c < 3; ++c) small.pixel(x, y)[c] += picture.pixel(u, v)[c];
      for (int c = 0; c < 3; ++c) small.pixel(x, y)[c] /= static_cast<float>((x1 - x0) * (y1 - y0));
    }
  return small;
}

Image contact_sheet(const std::vector<std::vector<Image>>& rows) {
  std::vector<int> widths, heights;
  for (const auto& row : rows) {
    heights.push_back(0);
    for (std::size_t column = 0; column < row.size(); ++column) {
      widths.resize(std::max(widths.size(), column + 1), 0);
      widths[column] = std::max(widths[column], row[column].width());
      heights.back() = std::max(heights.back(), row[column].height());
    }
  }
  int width = kGap, height = kGap;
  for (const int w : widths) width += w + kGap;
  for (const int h : heights) height += h + kGap;
  Image sheet(width, height, 3, kSheetGrey);
  int top = kGap;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    int left = kGap;
    for (std::size_t column = 0; column < rows[r].size(); ++column) {
      paste(rows[r][column], left, top, sheet);
      left += widths[column] + kGap;
    }
    top += heights[r] + kGap;
  }
  return sheet;
}

}  // namespace roxel

#include "roxel/image/undistort.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using Eigen::Vector2d;

/// The four pixels around a position and their weights. At the image's rim, where a position has neighbours
/// on one side only, those are repeated.
struct Taps {
  int x0, x1, y0, y1;
  float wx, wy;  ///< weight of x1 and of y1

  Taps(float x, float y, int width, int height) {
    const float left = std::floor(x - 0.5f), top = std::floor(y - 0.5f);
    wx = x - 0.5f - left;
    wy = y - 0.5f - top;
    x0 = std::clamp(static_cast<int>(left), 0, width - 1);
    x1 = std::clamp(static_cast<int>(left) + 1, 0, width - 1);
    y0 = std::clamp(static_cast<int>(top), 0, height - 1);
    y1 = std::clamp(static_cast<int>(top) + 1, 0, height - 1);
  }

  float blend(float v00, float v10, float v01, float v11) const {
    return (1 - wy) * ((1 - wx) * v00 + wx * v10) + wy * ((1 - wx) * v01 + wx * v11);
  }
};

/// Largest |normalised| of the image's corners.
double corner_radius(const Intrinsics& k) {
  double radius = 0;
  for (const double x : {0.0, static_cast<double>(k.width)})
    for (const double y : {0.0, static_cast<double>(k.height)})
      radius = std::max(radius, normalised_from_pixel(k, {x, y}).norm());
  return radius;
}

void check_size(int width, int height, const Intrinsics& expected) {
  ROXEL_CHECK_EQ(width, expected.width);
  ROXEL_CHECK_EQ(height, expected.height);
}

}  // namespace

PinholeCamera undistorted_camera(const Lens& lens, const Pose& pose) {
  PinholeCamera camera{lens.intrinsics, pose};
  const double widest = std::tan(85 * std::numbers::pi / 180);
  const double excess = corner_radius(lens.intrinsics) / widest;
  if (has_distortion(lens) && excess > 1) {
    // Scaling K's first two rows but for the principal point scales every normalised position back.
    camera.intrinsics.fx *= excess;
    camera.intrinsics.fy *= excess;
    camera.intrinsics.skew *= excess;
  }
  return camera;
}

UndistortMap::UndistortMap(const Lens& lens, const Intrinsics& pinhole)
    : lens_(lens.intrinsics), pinhole_(pinhole) {
  if (!has_distortion(lens) && lens_ == pinhole_) return;
  const double radius = has_distortion(lens) ? valid_radius(lens) : std::numeric_limits<double>::infinity();
  const float none = std::numeric_limits<float>::quiet_NaN();
  sources_.reserve(static_cast<std::size_t>(pinhole.width) * pinhole.height);
  for (int y = 0; y < pinhole.height; ++y) {
    for (int x = 0; x < pinhole.width; ++x) {
      const Vector2d normalised = normalised_from_pixel(pinhole, {x + 0.5, y + 0.5});
      Vector2d source(none, none);
      if (normalised.norm() <= radius) source = pixel_from_normalised(lens_, distort(lens, normalised));
      const bool inside =
          source.x() >= 0 && source.x() <= lens_.width && source.y() >= 0 && source.y() <= lens_.height;
      sources_.push_back(inside ? Position{static_cast<float>(source.x()), static_cast<float>(source.y())}
                                : Position{none, none});
    }
  }
}

Image UndistortMap::apply(const Image& source) const {
  check_size(source.width(), source.height(), lens_);
  if (identity()) return source;
  const int channels = source.channels();
  Image result(pinhole_.width, pinhole_.height, channels);
  float* out = result.data().data();
  for (const Position& p : sources_) {
    if (!std::isnan(p.x)) {
      const Taps t(p.x, p.y, lens_.width, lens_.height);
      const float* v00 = source.pixel(t.x0, t.y0);
      const float* v10 = source.pixel(t.x1, t.y0);
      const float* v01 = source.pixel(t.x0, t.y1);
      const float* v11 = source.pixel(t.x1, t.y1);
      for (int c = 0; c < channels; ++c) out[c] = t.blend(v00[c], v10[c], v01[c], v11[c]);
    }
    out += channels;
  }
  return result;
}

Mask UndistortMap::apply(const Mask& source) const {
  check_size(source.width(), source.height(), lens_);
  if (identity()) return source;
  Mask result(pinhole_.width, pinhole_.height, 0);
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const Position& p = sources_[i];
    if (std::isnan(p.x)) continue;
    const Taps t(p.x, p.y, lens_.width, lens_.height);
    const float value =
        t.blend(source.at(t.x0, t.y0), source.at(t.x1, t.y0), source.at(t.x0, t.y1), source.at(t.x1, t.y1));
    result.data()[i] = static_cast<std::uint8_t>(std::lround(value));
  }
  return result;
}

Mask UndistortMap::valid(const Mask& source_valid) const {
  if (!source_valid.empty()) check_size(source_valid.width(), source_valid.height(), lens_);
  if (identity()) return source_valid;
  Mask result(pinhole_.width, pinhole_.height, 255);
  bool all = true;
  const auto usable = [&](const Position& p) {
    if (std::isnan(p.x)) return false;
    if (source_valid.empty()) return true;
    const Taps t(p.x, p.y, lens_.width, lens_.height);
    const auto ok = [&](int x, int y) { return source_valid.at(x, y) == 255; };
    return ok(t.x0, t.y0) && ok(t.x1, t.y0) && ok(t.x0, t.y1) && ok(t.x1, t.y1);
  };
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    if (usable(sources_[i])) continue;
    result.data()[i] = 0;
    all = false;
  }
  return all ? Mask() : result;
}

Image undistort(const Image& source, const Lens& lens, const Intrinsics& pinhole, Mask& valid) {
  const UndistortMap map(lens, pinhole);
  valid = map.valid();
  return map.apply(source);
}

Mask undistort(const Mask& source, const Lens& lens, const Intrinsics& pinhole) {
  return UndistortMap(lens, pinhole).apply(source);
}

}  // namespace roxel

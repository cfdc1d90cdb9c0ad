#include "roxel/sky/sky_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "roxel/base/angles.h"

namespace roxel {
namespace {

/// Of the rectangle from the axis to (x, y) at distance 1; odd in both.
double corner_solid_angle(double x, double y) { return std::atan(x * y / std::sqrt(1 + x * x + y * y)); }

double pixel_solid_angle(const Intrinsics& k, int x, int y) {
  if (k.skew != 0) {
    const Eigen::Vector2d p = normalised_from_pixel(k, {x + 0.5, y + 0.5});
    return 1 / (k.fx * k.fy) / std::pow(1 + p.squaredNorm(), 1.5);
  }
  const double x0 = (x - k.cx) / k.fx, x1 = (x + 1 - k.cx) / k.fx;
  const double y0 = (y - k.cy) / k.fy, y1 = (y + 1 - k.cy) / k.fy;
  return std::abs(corner_solid_angle(x1, y1) - corner_solid_angle(x0, y1) - corner_solid_angle(x1, y0) +
                  corner_solid_angle(x0, y0));
}

}  // namespace

Eigen::Vector3d Equirectangular::direction(double u, double v) const {
  const double azimuth = (u / width - 0.5) * 2 * kPi, elevation = (0.5 - v / height) * kPi;
  return {std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth),
          std::sin(elevation)};
}

Eigen::Vector2d Equirectangular::position(const Eigen::Vector3d& d) const {
  const double azimuth = std::atan2(d.x(), d.y()), elevation = std::atan2(d.z(), std::hypot(d.x(), d.y()));
  return {(azimuth / (2 * kPi) + 0.5) * width, (0.5 - elevation / kPi) * height};
}

PixelRays::PixelRays(const Equirectangular& panorama)
    : camera_(panorama), width_(panorama.width), height_(panorama.height) {}

PixelRays::PixelRays(const PinholeCamera& camera, const Eigen::Matrix3d& sky_from_world)
    : camera_(camera),
      sky_from_camera_(sky_from_world * camera.pose.rotation.transpose()),
      width_(camera.intrinsics.width),
      height_(camera.intrinsics.height) {}

Eigen::Vector3d PixelRays::direction(double u, double v) const {
  if (const auto* panorama = std::get_if<Equirectangular>(&camera_)) return panorama->direction(u, v);
  const Eigen::Vector2d p = normalised_from_pixel(std::get<PinholeCamera>(camera_).intrinsics, {u, v});
  return (sky_from_camera_ * Eigen::Vector3d(p.x(), p.y(), 1)).normalized();
}

std::optional<Eigen::Vector2d> PixelRays::position(const Eigen::Vector3d& direction) const {
  if (const auto* panorama = std::get_if<Equirectangular>(&camera_)) return panorama->position(direction);
  const Eigen::Vector3d x = sky_from_camera_.transpose() * direction;
  if (!(x.z() > 1e-6)) return std::nullopt;
  return pixel_from_normalised(std::get<PinholeCamera>(camera_).intrinsics, {x.x() / x.z(), x.y() / x.z()});
}

double PixelRays::solid_angle(int x, int y) const {
  if (const auto* panorama = std::get_if<Equirectangular>(&camera_)) {
    const double top = (0.5 - static_cast<double>(y) / panorama->height) * kPi;
    const double bottom = (0.5 - (y + 1.0) / panorama->height) * kPi;
    return 2 * kPi / panorama->width * (std::sin(top) - std::sin(bottom));
  }
  return pixel_solid_angle(std::get<PinholeCamera>(camera_).intrinsics, x, y);
}

namespace {

PixelRange range_of(const Equirectangular& panorama, const Eigen::Vector3d& direction, double angle) {
  const Eigen::Vector2d at = panorama.position(direction);
  const double rows = angle / kPi * panorama.height;
  PixelRange range{0, std::max(0, static_cast<int>(std::floor(at.y() - rows))), panorama.width,
                   std::min(panorama.height, static_cast<int>(std::ceil(at.y() + rows)) + 1)};
  // The circle's widest azimuth; around the zenith it is all of them.
  const double widest = std::sin(angle) / std::max(1e-9, std::hypot(direction.x(), direction.y()));
  const double columns = widest < 1 ? std::asin(widest) / (2 * kPi) * panorama.width : panorama.width;
  if (2 * columns + 2 >= panorama.width) return range;
  range.x0 = static_cast<int>(std::floor(at.x() - columns));
  range.x1 = static_cast<int>(std::ceil(at.x() + columns)) + 1;
  return range;
}

}  // namespace

PixelRange PixelRays::around(const Eigen::Vector3d& direction, double angle) const {
  if (const auto* panorama = std::get_if<Equirectangular>(&camera_))
    return range_of(*panorama, direction, angle);
  // A circle in front of the camera is an ellipse in the picture: its box is that of the points on it.
  constexpr int kPoints = 32;
  const Eigen::Vector3d right = direction.unitOrthogonal(), up = direction.cross(right);
  Eigen::AlignedBox2d box;
  for (int i = 0; i < kPoints; ++i) {
    const double turn = 2 * kPi * i / kPoints;
    const Eigen::Vector3d across = std::cos(turn) * right + std::sin(turn) * up;
    const auto at = position(std::cos(angle) * direction + std::sin(angle) * across);
    if (!at) return {0, 0, width_, height_};
    box.extend(*at);
  }
  const Eigen::Array2d margin = (0.01 * box.sizes().array() + 1);  // between the points, and to pixel centres
  const auto bounded = [](double value, int most) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(most)));
  };
  return {bounded(box.min().x() - margin.x(), width_), bounded(box.min().y() - margin.y(), height_),
          bounded(box.max().x() + margin.x() + 1, width_), bounded(box.max().y() + margin.y() + 1, height_)};
}

double PixelRays::pixel_angle() const {
  if (std::holds_alternative<Equirectangular>(camera_)) return 2 * kPi / width_;
  const Intrinsics& k = std::get<PinholeCamera>(camera_).intrinsics;
  return 1 / std::sqrt(k.fx * k.fy);
}

double clip_level(const Image& rgb) {
  // No other value of half floats, and none of Radiance files, lies between 65 472 and their end at 65 504.
  constexpr double kDisplayWhite = 1.0001, kJustBelowWhite = 0.985, kHalfEnd = 65000, kAtHalfEnd = 65473;
  constexpr int kShared = 4;
  float highest = 0;
  for (const float value : rgb.data()) highest = std::max(highest, value);
  if (highest <= kDisplayWhite) return kJustBelowWhite;
  int sharing = 0;
  for (int y = 0; y < rgb.height(); ++y)
    for (int x = 0; x < rgb.width(); ++x) {
      const float* pixel = rgb.pixel(x, y);
      sharing += std::find(pixel, pixel + rgb.channels(), highest) != pixel + rgb.channels();
    }
  if (sharing >= kShared) return 0.999 * highest;
  return highest > kAtHalfEnd && highest < 65505 ? kHalfEnd : std::numeric_limits<double>::infinity();
}

}  // namespace roxel

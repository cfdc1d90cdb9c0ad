#include "roxel/sky/sky_picture.h"

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

double PixelRays::pixel_angle() const {
  if (std::holds_alternative<Equirectangular>(camera_)) return 2 * kPi / width_;
  const Intrinsics& k = std::get<PinholeCamera>(camera_).intrinsics;
  return 1 / std::sqrt(k.fx * k.fy);
}

double clip_level(const Image& rgb) {
  constexpr double kDisplayWhite = 1.0001, kJustBelowWhite = 0.985, kHalfEnd = 65000;
  constexpr int kShared = 4;
  float highest = 0;
  for (const float value : rgb.data()) highest = std::max(highest, value);
  if (highest <= kDisplayWhite) return kJustBelowWhite;
  const auto sharing = std::count(rgb.data().begin(), rgb.data().end(), highest);
  return sharing >= kShared ? 0.999 * highest : kHalfEnd;
}

}  // namespace roxel

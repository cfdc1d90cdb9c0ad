#include "roxel/synth/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "roxel/base/angles.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

Eigen::Map<const Vector3f> texel(const Image& map, int x, int y) {
  const int column = (x % map.width() + map.width()) % map.width();
  return Eigen::Map<const Vector3f>(map.pixel(column, std::clamp(y, 0, map.height() - 1)));
}

float solid_angle(float angular_radius) { return 2 * kPiFloat * (1 - std::cos(angular_radius)); }

}  // namespace

Vector3f map_direction(const Image& map, float u, float v) {
  const float azimuth = (u / static_cast<float>(map.width()) - 0.5f) * 2 * kPiFloat;
  const float elevation = (0.5f - v / static_cast<float>(map.height())) * kPiFloat;
  return {std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth),
          std::sin(elevation)};
}

Vector2f map_position(const Image& map, const Vector3f& direction) {
  const float azimuth = std::atan2(direction.x(), direction.y());
  const float elevation = std::asin(std::clamp(direction.z(), -1.0f, 1.0f));
  return {(azimuth / (2 * kPiFloat) + 0.5f) * static_cast<float>(map.width()),
          (0.5f - elevation / kPiFloat) * static_cast<float>(map.height())};
}

Vector3f Sun::radiance() const { return irradiance / solid_angle(angular_radius_rad); }

Environment::Environment(const std::function<Vector3f(const Vector3f&)>& radiance, const Sun& sun)
    : map_(kWidth, kHeight, 3), sun_(sun) {
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      Eigen::Map<Vector3f>(map_.pixel(x, y)) = radiance(map_direction(map_, x + 0.5f, y + 0.5f));
}

Vector3f Environment::sky(const Vector3f& direction) const {
  const Vector2f at = map_position(map_, direction) - Vector2f(0.5f, 0.5f);
  const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
  const float s = at.x() - static_cast<float>(x), t = at.y() - static_cast<float>(y);
  const Vector3f above = (1 - s) * texel(map_, x, y) + s * texel(map_, x + 1, y);
  const Vector3f below = (1 - s) * texel(map_, x, y + 1) + s * texel(map_, x + 1, y + 1);
  return (1 - t) * above + t * below;
}

// Angles this small are sines of themselves; comparing cosines would lose them in rounding.
Vector3f Environment::seen(const Vector3f& direction) const {
  const bool on_disc = direction.dot(sun_.direction) > 0 &&
                       direction.cross(sun_.direction).norm() < std::sin(sun_.angular_radius_rad);
  return on_disc ? Vector3f(sky(direction) + sun_.radiance()) : sky(direction);
}

// The disc is thrown onto the map as points that carry equal light.
Image Environment::map_with_disc() const {
  Image map = map_;
  if (sun_.irradiance.isZero()) return map;
  constexpr int kRings = 32, kSpokes = 64;
  const Vector3f w = sun_.direction;
  const Vector3f u = (std::abs(w.z()) < 0.9f ? Vector3f::UnitZ() : Vector3f::UnitX()).cross(w).normalized();
  const Vector3f v = w.cross(u);
  for (int i = 0; i < kRings; ++i)
    for (int k = 0; k < kSpokes; ++k) {
      const float radius = sun_.angular_radius_rad * std::sqrt((static_cast<float>(i) + 0.5f) / kRings);
      const float turn = 2 * kPiFloat * static_cast<float>(k) / kSpokes;
      const Vector3f direction = w + std::tan(radius) * (std::cos(turn) * u + std::sin(turn) * v);
      const Vector2f at = map_position(map, direction.normalized());
      const int x = std::min(static_cast<int>(at.x()), kWidth - 1),
                y = std::min(static_cast<int>(at.y()), kHeight - 1);
      const float elevation = (0.5f - (static_cast<float>(y) + 0.5f) / kHeight) * kPiFloat;
      const float pixel = (2 * kPiFloat / kWidth) * (kPiFloat / kHeight) * std::cos(elevation);
      Eigen::Map<Vector3f>(map.pixel(x, y)) += sun_.irradiance / (pixel * kRings * kSpokes);
    }
  return map;
}

Vector3f Environment::sky_irradiance() const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int y = 0; y < kHeight / 2; ++y) {
    const double elevation = (0.5 - (y + 0.5) / kHeight) * std::numbers::pi;
    const double weight = std::sin(elevation) * std::cos(elevation);
    for (int x = 0; x < kWidth; ++x) sum += weight * texel(map_, x, y).cast<double>();
  }
  return (sum * (2 * std::numbers::pi / kWidth) * (std::numbers::pi / kHeight)).cast<float>();
}

Vector3f Environment::total_irradiance() const {
  return sky_irradiance() + std::max(sun_.direction.z(), 0.0f) * sun_.irradiance;
}

}  // namespace roxel

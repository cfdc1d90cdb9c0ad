#pragma once
/// Small functions that textures, shapes and light share.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace roxel {

/// From 0 at `from` to 1 at `to`, level at both and beyond.
inline float ramp(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

inline Eigen::Vector3f mix(const Eigen::Vector3f& a, const Eigen::Vector3f& b, float share_b) {
  return a + std::clamp(share_b, 0.0f, 1.0f) * (b - a);
}

/// Two unit vectors that make a right-handed frame with the unit vector w.
inline void frame_about(const Eigen::Vector3f& w, Eigen::Vector3f& u, Eigen::Vector3f& v) {
  u = (std::abs(w.x()) < 0.7f ? Eigen::Vector3f::UnitX() : Eigen::Vector3f::UnitY()).cross(w).normalized();
  v = w.cross(u);
}

}  // namespace roxel

#pragma once
/// Signed distances to simple solids about the origin, Z up: negative inside, and outside never more than the
/// true distance, so that a ray may always advance by it.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace roxel {

/// Length of (a, b); std::hypot guards against overflow, at several times the cost.
inline float length2(float a, float b) { return std::sqrt(a * a + b * b); }

inline float sphere_distance(const Eigen::Vector3f& p, float radius) { return p.norm() - radius; }

/// Distance from a point (r, z) of the half plane to the rectangle |r| <= half_r, |z| <= half_z.
inline float rectangle_distance(float r, float z, float half_r, float half_z) {
  const float dr = std::abs(r) - half_r, dz = std::abs(z) - half_z;
  return std::min(std::max(dr, dz), 0.0f) + length2(std::max(dr, 0.0f), std::max(dz, 0.0f));
}

/// An upright cylinder from z = bottom to z = top.
inline float cylinder_distance(const Eigen::Vector3f& p, float radius, float bottom, float top) {
  return rectangle_distance(p.head<2>().norm(), p.z() - 0.5f * (bottom + top), radius, 0.5f * (top - bottom));
}

inline float box_distance(const Eigen::Vector3f& p, const Eigen::Vector3f& half) {
  const Eigen::Vector3f d = p.cwiseAbs() - half;
  return std::min(d.maxCoeff(), 0.0f) + d.cwiseMax(0.0f).norm();
}

/// A ring around the Z axis.
inline float torus_distance(const Eigen::Vector3f& p, float ring_radius, float tube_radius) {
  return length2(p.head<2>().norm() - ring_radius, p.z()) - tube_radius;
}

/// A rod with round ends from the origin to z = height.
inline float rod_distance(const Eigen::Vector3f& p, float height, float radius) {
  return length2(p.head<2>().norm(), p.z() - std::clamp(p.z(), 0.0f, height)) - radius;
}

/// An ellipsoid about the origin.
class Ellipsoid {
 public:
  Ellipsoid() = default;
  Ellipsoid(float half_x, float half_y, float half_z)
      : inverse_(1 / half_x, 1 / half_y, 1 / half_z), smallest_(std::min({half_x, half_y, half_z})) {}

  /// A bound that is exact at the surface to first order.
  float distance(const Eigen::Vector3f& p) const {
    const Eigen::Vector3f unit = p.cwiseProduct(inverse_);
    const float k0 = unit.norm(), k1 = unit.cwiseProduct(inverse_).norm();
    return k1 > 0 ? k0 * (k0 - 1) / k1 : -smallest_;
  }

 private:
  Eigen::Vector3f inverse_ = Eigen::Vector3f::Ones();
  float smallest_ = 1;
};

/// Union of two solids with their seam filled over a width of about `radius`.
inline float smooth_union(float a, float b, float radius) {
  const float h = std::max(radius - std::abs(a - b), 0.0f) / radius;
  return std::min(a, b) - 0.25f * h * h * radius;
}

/// Intersection of two solids with its edge rounded over a width of about `radius`.
inline float smooth_intersection(float a, float b, float radius) { return -smooth_union(-a, -b, radius); }

}  // namespace roxel

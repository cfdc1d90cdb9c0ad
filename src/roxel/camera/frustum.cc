#include "roxel/camera/frustum.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

/// Directions through the image's corners with unit z in the camera, clockwise from the top left; world axes.
std::array<Vector3d, 4> corner_directions(const PinholeCamera& camera) {
  const double w = camera.intrinsics.width, h = camera.intrinsics.height;
  return {camera.ray(0, 0).direction, camera.ray(w, 0).direction, camera.ray(w, h).direction,
          camera.ray(0, h).direction};
}

Points box_corners(const Eigen::AlignedBox3d& box) {
  Points corners;
  for (int i = 0; i < 8; ++i) corners.push_back(box.corner(Eigen::AlignedBox3d::CornerType(i)));
  return corners;
}

std::pair<double, double> extent(const Points& points, const Vector3d& axis) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Vector3d& p : points) {
    low = std::min(low, axis.dot(p));
    high = std::max(high, axis.dot(p));
  }
  return {low, high};
}

bool separates(const Vector3d& axis, const Points& a, const Points& b) {
  const auto [a_low, a_high] = extent(a, axis);
  const auto [b_low, b_high] = extent(b, axis);
  return a_high < b_low || b_high < a_low;
}

/// Normals of both bodies' faces and the products of their edges: two convex bodies are apart exactly when
/// one of these axes separates them.
Points candidate_axes(const std::array<Vector3d, 4>& corners, const Vector3d& forward) {
  Points edges(corners.begin(), corners.end());
  edges.push_back(corners[1] - corners[0]);
  edges.push_back(corners[3] - corners[0]);
  Points axes{forward};
  for (int i = 0; i < 4; ++i) axes.push_back(corners[i].cross(corners[(i + 1) % 4]));
  for (int k = 0; k < 3; ++k) {
    axes.push_back(Vector3d::Unit(k));
    for (const Vector3d& edge : edges) axes.push_back(Vector3d::Unit(k).cross(edge));
  }
  return axes;
}

}  // namespace

std::array<Vector3d, 8> frustum_corners(const PinholeCamera& camera, const FrustumRange& range) {
  ROXEL_CHECK(std::isfinite(range.far));
  const auto directions = corner_directions(camera);
  std::array<Vector3d, 8> corners;
  for (int i = 0; i < 4; ++i) {
    corners[i] = camera.pose.centre + range.near * directions[i];
    corners[i + 4] = camera.pose.centre + range.far * directions[i];
  }
  return corners;
}

bool sees(const PinholeCamera& camera, const Vector3d& x_in_world, const FrustumRange& range) {
  const Vector3d p = camera.project(x_in_world);
  if (!(p.z() > 0) || p.z() < range.near || p.z() > range.far) return false;
  return p.x() >= 0 && p.x() <= camera.intrinsics.width && p.y() >= 0 && p.y() <= camera.intrinsics.height;
}

bool sees_box(const PinholeCamera& camera, const Eigen::AlignedBox3d& box, const FrustumRange& range) {
  if (box.isEmpty()) return false;
  // Work about the optical centre, and let the frustum end where the box does.
  Points corners = box_corners(box);
  for (Vector3d& corner : corners) corner -= camera.pose.centre;
  const Vector3d forward = camera.pose.rotation.row(2);
  const double deepest = extent(corners, forward).second;
  if (deepest <= 0 || deepest < range.near) return false;
  const double far = std::min(range.far, deepest);
  const auto directions = corner_directions(camera);
  Points frustum;
  for (const Vector3d& d : directions) {
    frustum.push_back(range.near * d);
    frustum.push_back(far * d);
  }
  const Points axes = candidate_axes(directions, forward);
  return std::none_of(axes.begin(), axes.end(),
                      [&](const Vector3d& axis) { return separates(axis, frustum, corners); });
}

}  // namespace roxel

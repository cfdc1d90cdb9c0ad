#include "roxel/sky/facet_sphere.h"

#include <Eigen/Geometry>
#include <mutex>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using Triangle = std::array<Eigen::Vector3d, 3>;

/// Bits of the octant: 1 = x < 0, 2 = y < 0, 4 = z < 0; corners turn the same way in all.
Triangle octant_corners(int octant) {
  const Eigen::Vector3d x(octant & 1 ? -1 : 1, 0, 0), y(0, octant & 2 ? -1 : 1, 0),
      z(0, 0, octant & 4 ? -1 : 1);
  const bool mirrored = ((octant & 1) + (octant >> 1 & 1) + (octant >> 2 & 1)) % 2 == 1;
  return mirrored ? Triangle{x, z, y} : Triangle{x, y, z};
}

int octant_of(const Eigen::Vector3d& d) {
  return (d.x() < 0 ? 1 : 0) | (d.y() < 0 ? 2 : 0) | (d.z() < 0 ? 4 : 0);
}

/// Child 0 to 2 keeps that corner, child 3 is the middle.
Triangle child_of(const Triangle& t, int child) {
  const Eigen::Vector3d ab = (t[0] + t[1]).normalized(), bc = (t[1] + t[2]).normalized(),
                        ca = (t[2] + t[0]).normalized();
  switch (child) {
    case 0:
      return {t[0], ab, ca};
    case 1:
      return {ab, t[1], bc};
    case 2:
      return {ca, bc, t[2]};
    default:
      return {ab, bc, ca};
  }
}

}  // namespace

double spherical_triangle_area(const Triangle& t) {
  const double volume = t[0].dot(t[1].cross(t[2]));
  const double base = 1 + t[0].dot(t[1]) + t[1].dot(t[2]) + t[2].dot(t[0]);
  return std::abs(2 * std::atan2(volume, base));
}

FacetSphere::FacetSphere(int level) : level_(level) {
  ROXEL_CHECK_GE(level, 0);
  ROXEL_CHECK_LE(level, kMostLevels);
  facets_.reserve(std::size_t{8} << (2 * level));
  for (int octant = 0; octant < 8; ++octant) divide(level, octant_corners(octant));
  for (Facet& facet : facets_)
    for (int edge = 0; edge < 3; ++edge) {
      // A little across the middle of the edge.
      const Eigen::Vector3d middle = (facet.corners[edge] + facet.corners[(edge + 1) % 3]).normalized();
      facet.neighbours[edge] = facet_at(middle + 0.01 * (middle - facet.centre));
    }
}

void FacetSphere::divide(int level, const Triangle& corners) {
  if (level > 0) {
    for (int child = 0; child < 4; ++child) divide(level - 1, child_of(corners, child));
    return;
  }
  Facet facet{
      corners, {}, (corners[0] + corners[1] + corners[2]).normalized(), spherical_triangle_area(corners), {}};
  for (int edge = 0; edge < 3; ++edge) facet.normals[edge] = corners[edge].cross(corners[(edge + 1) % 3]);
  facets_.push_back(facet);
}

std::shared_ptr<const FacetSphere> FacetSphere::of_level(int level) {
  static std::mutex mutex;
  static std::array<std::shared_ptr<const FacetSphere>, kMostLevels + 1> made;
  ROXEL_CHECK_GE(level, 0);
  ROXEL_CHECK_LE(level, kMostLevels);
  const std::lock_guard<std::mutex> lock(mutex);
  if (!made[level]) made[level] = std::make_shared<const FacetSphere>(level);
  return made[level];
}

int FacetSphere::facet_at(const Eigen::Vector3d& direction) const {
  const int octant = octant_of(direction);
  Triangle triangle = octant_corners(octant);
  int index = octant;
  for (int level = 0; level < level_; ++level) {
    const Triangle middle = child_of(triangle, 3);  // ab, bc, ca
    int child = 3;
    // Corner 0 is beyond the edge from ca to ab, corner 1 beyond ab to bc, corner 2 beyond bc to ca.
    if (direction.dot(middle[2].cross(middle[0])) < 0)
      child = 0;
    else if (direction.dot(middle[0].cross(middle[1])) < 0)
      child = 1;
    else if (direction.dot(middle[1].cross(middle[2])) < 0)
      child = 2;
    triangle = child_of(triangle, child);
    index = 4 * index + child;
  }
  return index;
}

bool FacetSphere::contains(int facet, const Eigen::Vector3d& direction) const {
  const auto& n = facets_[facet].normals;
  return n[0].dot(direction) > 0 && n[1].dot(direction) > 0 && n[2].dot(direction) > 0;
}

}  // namespace roxel

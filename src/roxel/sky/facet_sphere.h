#pragma once
/// The sphere of directions in facets: an octahedron whose triangles are divided into four, again and again,
/// with new corners pushed out to the sphere ([Jethwa04] figure 3.5). Level 6 has 32 768 facets of 1.7
/// degrees.

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

namespace roxel {

class FacetSphere {
 public:
  static constexpr int kMostLevels = 8;

  /// 8 x 4^level facets, 0 <= level <= kMostLevels.
  explicit FacetSphere(int level);
  /// One for all who ask for that level. Thread safe.
  static std::shared_ptr<const FacetSphere> of_level(int level);

  int level() const { return level_; }
  int count() const { return static_cast<int>(facets_.size()); }
  /// The facet that holds a direction (of any length but 0).
  int facet_at(const Eigen::Vector3d& direction) const;
  /// Whether this facet holds it; cheaper than facet_at for directions in a row.
  bool contains(int facet, const Eigen::Vector3d& direction) const;

  const std::array<Eigen::Vector3d, 3>& corners(int facet) const { return facets_[facet].corners; }
  /// Unit vector through the middle of the corners.
  const Eigen::Vector3d& centre(int facet) const { return facets_[facet].centre; }
  /// Steradians; all facets together are the whole sphere.
  double solid_angle(int facet) const { return facets_[facet].solid_angle; }
  /// Of the planes through the edges, inwards; of no particular length.
  const std::array<Eigen::Vector3d, 3>& normals(int facet) const { return facets_[facet].normals; }
  /// Across the edges.
  const std::array<int, 3>& neighbours(int facet) const { return facets_[facet].neighbours; }

 private:
  struct Facet {
    std::array<Eigen::Vector3d, 3> corners, normals;
    Eigen::Vector3d centre;
    double solid_angle;
    std::array<int, 3> neighbours;
  };
  void divide(int level, const std::array<Eigen::Vector3d, 3>& corners);

  int level_;
  std::vector<Facet> facets_;
};

/// Of the triangle that three unit vectors span [VanOosterom83].
double spherical_triangle_area(const std::array<Eigen::Vector3d, 3>& corners);

}  // namespace roxel

#include "roxel/sky/facet_parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace roxel {
namespace {

constexpr double kSliver = 1e-9;  ///< share of a patch that is not worth a facet

/// What of a polygon of unit vectors is on the side of a plane through the centre that its normal points to
/// [Sutherland74].
void keep_inside(const Eigen::Vector3d& normal, const std::vector<Eigen::Vector3d>& polygon,
                 std::vector<Eigen::Vector3d>& kept) {
  kept.clear();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector3d &from = polygon[i], &to = polygon[(i + 1) % polygon.size()];
    const double a = normal.dot(from), b = normal.dot(to);
    if (a >= 0) kept.push_back(from);
    if ((a < 0) != (b < 0) && a != 0) kept.push_back((std::abs(b) * from + std::abs(a) * to).normalized());
  }
}

double convex_area(const std::vector<Eigen::Vector3d>& polygon) {
  double area = 0;
  for (std::size_t i = 2; i < polygon.size(); ++i)
    area += spherical_triangle_area({polygon[0], polygon[i - 1], polygon[i]});
  return area;
}

}  // namespace

const std::vector<FacetPart>& FacetParts::divide(const std::array<Eigen::Vector3d, 4>& corners) {
  parts_.clear();
  const Eigen::Vector3d middle = (corners[0] + corners[1] + corners[2] + corners[3]).normalized();
  const auto holds = [&](int facet) {
    return std::all_of(corners.begin(), corners.end(),
                       [&](const Eigen::Vector3d& corner) { return sphere_.contains(facet, corner); });
  };
  if (!sphere_.contains(last_facet_, middle)) last_facet_ = sphere_.facet_at(middle);
  if (holds(last_facet_)) {
    parts_.push_back({last_facet_, 1, middle});
    return parts_;
  }
  // From facet to facet across the edges that the patch reaches over.
  reached_.assign(1, last_facet_);
  for (std::size_t i = 0; i < reached_.size(); ++i) {
    const int facet = reached_[i];
    if (!cut(facet, corners)) continue;
    for (int edge = 0; edge < 3; ++edge) {
      const Eigen::Vector3d& inwards = sphere_.normals(facet)[edge];
      const int across = sphere_.neighbours(facet)[edge];
      if (std::any_of(corners.begin(), corners.end(), [&](const auto& c) { return inwards.dot(c) < 0; }) &&
          std::find(reached_.begin(), reached_.end(), across) == reached_.end())
        reached_.push_back(across);
    }
  }
  double whole = 0;
  for (const FacetPart& part : parts_) whole += part.share;
  std::erase_if(parts_, [&](const FacetPart& part) { return !(part.share > kSliver * whole); });
  if (parts_.empty()) parts_.push_back({last_facet_, 1, middle});  // a patch without an area
  whole = 0;
  for (const FacetPart& part : parts_) whole += part.share;
  for (FacetPart& part : parts_) part.share /= whole;
  return parts_;
}

bool FacetParts::cut(int facet, const std::array<Eigen::Vector3d, 4>& corners) {
  polygon_.assign(corners.begin(), corners.end());
  for (const Eigen::Vector3d& inwards : sphere_.normals(facet)) {
    keep_inside(inwards, polygon_, kept_);
    polygon_.swap(kept_);
    if (polygon_.size() < 3) return false;
  }
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& corner : polygon_) middle += corner;
  parts_.push_back({facet, convex_area(polygon_), middle.normalized()});
  return true;
}

}  // namespace roxel

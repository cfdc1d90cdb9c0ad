#pragma once
/// How a pixel's patch of the sphere divides among facets.

#include <array>
#include <vector>

#include "roxel/sky/facet_sphere.h"

namespace roxel {

struct FacetPart {
  int facet;
  double share;            ///< of the patch's area, 0 to 1
  Eigen::Vector3d middle;  ///< unit, within the part
};

/// Divides patches one after another, fast where they are close together. Not for several threads at once.
class FacetParts {
 public:
  explicit FacetParts(const FacetSphere& sphere) : sphere_(sphere) {}

  /// Of a convex patch, below a quarter turn across, with these unit corners in turn and great circles
  /// between them, as a pinhole camera's pixel has them: exact to rounding. Shares sum to 1; none is below
  /// 1e-9. Valid until the next call.
  const std::vector<FacetPart>& divide(const std::array<Eigen::Vector3d, 4>& corners);

 private:
  /// Adds the facet's part, in steradians. Says whether there is one.
  bool cut(int facet, const std::array<Eigen::Vector3d, 4>& corners);

  const FacetSphere& sphere_;
  int last_facet_ = 0;
  std::vector<FacetPart> parts_;
  std::vector<int> reached_;
  std::vector<Eigen::Vector3d> polygon_, kept_;
};

}  // namespace roxel

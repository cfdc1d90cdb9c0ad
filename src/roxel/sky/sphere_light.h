#pragma once
/// The light that a node's pictures see, gathered on the facets of a sphere ([Jethwa04] §3.3).

#include <memory>
#include <vector>

#include "roxel/sky/facet_parts.h"
#include "roxel/sky/facet_sphere.h"
#include "roxel/sky/sky_picture.h"

namespace roxel {

/// Pixels count by their solid angle, on each facet by that of their part of it. Clipped pixels are counted,
/// but not in means and variances.
struct FacetLight {
  double weight = 0;   ///< steradians of usable pixels, of all pictures together
  double clipped = 0;  ///< steradians of clipped pixels
  Eigen::Vector3d clipped_mean = Eigen::Vector3d::Zero();  ///< of clipped pixels; what clips is a lower bound
  double clip = 0;       ///< lowest level at which a picture clips that clips here; 0 where none does
  double judged = 0;     ///< steradians of pictures with a mask by hand
  double known_sky = 0;  ///< and what of it that mask calls sky
  double open = 0;       ///< steradians of rays that a volume lets through
  double coverage = 0;   ///< share of the facet that the picture which sees most of it sees (clipped too)
  double pixels = 0;     ///< usable ones, those that reach over several facets by their parts
  int pictures = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();      ///< radiance a channel
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();  ///< of radiance in the facet, a channel
  double contrast = 0;      ///< standard deviation of luminance in the facet over its mean
  double disagreement = 0;  ///< of the pictures' means of luminance: standard deviation over mean
  double peak = 0;          ///< highest luminance of a pixel, clipped ones too
  Eigen::Vector3d bright =
      Eigen::Vector3d::Zero();  ///< sum of luminance x steradians x direction, clipped too
};

/// Share of what is seen of a facet that is clipped.
inline double clipped_share(const FacetLight& facet) {
  return facet.clipped > 0 ? facet.clipped / (facet.weight + facet.clipped) : 0;
}

/// Whether masks by hand say that a facet is sky.
inline bool is_known_sky(const FacetLight& facet) {
  return facet.judged > 0 && facet.known_sky > 0.9 * facet.judged;
}

/// Whether a volume knows of nothing where the facet is.
inline bool is_open(const FacetLight& facet) { return facet.open > 0.8 * (facet.weight + facet.clipped); }

struct SphereLight {
  std::shared_ptr<const FacetSphere> sphere;
  std::vector<FacetLight> facets;
  int pictures = 0;
  int masked_by_hand = 0;  ///< pictures with a mask that says what is sky
};

/// Adds pictures up, one at a time; the result depends on their order in the last bits only.
class SphereLightSum {
 public:
  explicit SphereLightSum(std::shared_ptr<const FacetSphere> sphere);

  void add(const SkyPicture& picture);
  SphereLight result() const;

 private:
  struct Sum {
    double weight = 0, clipped = 0, judged = 0, known_sky = 0, open = 0;
    double pixels = 0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero(), second = Eigen::Vector3d::Zero();
    Eigen::Vector3d clipped_first = Eigen::Vector3d::Zero();
    double clip = 0, luminance_second = 0, peak = 0;
    Eigen::Vector3d bright = Eigen::Vector3d::Zero();
  };
  struct Total : Sum {
    double coverage = 0, between_weight = 0, between_first = 0, between_second = 0;
    int pictures = 0;
  };
  void add_pixel(const SkyPicture& picture, int x, int y, const std::array<Eigen::Vector3d, 4>& corners);
  void fold();

  std::shared_ptr<const FacetSphere> sphere_;
  std::vector<Sum> picture_;
  std::vector<int> touched_;
  std::vector<Total> total_;
  FacetParts parts_;
  int pictures_ = 0, masked_by_hand_ = 0;
};

}  // namespace roxel

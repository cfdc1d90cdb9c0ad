#pragma once
/// The light that a node's pictures see, gathered on the facets of a sphere ([Jethwa04] §3.3).

#include <cstdint>
#include <memory>
#include <vector>

#include "roxel/sky/facet_sphere.h"
#include "roxel/sky/sky_picture.h"

namespace roxel {

/// Pixels count by their solid angle. Clipped pixels are counted, but not in means and variances.
struct FacetLight {
  double weight = 0;     ///< steradians of usable pixels, of all pictures together
  double clipped = 0;    ///< steradians of clipped pixels
  double known_sky = 0;  ///< steradians that a mask by hand calls sky
  double open = 0;       ///< steradians of rays that a volume lets through
  double coverage = 0;   ///< share of the facet that the picture which sees most of it sees (clipped too)
  std::int64_t pixels = 0;
  int pictures = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();      ///< radiance a channel
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();  ///< of radiance in the facet, a channel
  double contrast = 0;      ///< standard deviation of luminance in the facet over its mean
  double disagreement = 0;  ///< of the pictures' means of luminance: standard deviation over mean
  double peak = 0;          ///< highest luminance of a pixel, clipped ones too
  Eigen::Vector3d bright =
      Eigen::Vector3d::Zero();  ///< sum of luminance x steradians x direction, clipped too
};

/// Whether a volume knows of nothing where the facet is.
inline bool is_open(const FacetLight& facet) { return facet.open > 0.8 * (facet.weight + facet.clipped); }

struct SphereLight {
  std::shared_ptr<const FacetSphere> sphere;
  std::vector<FacetLight> facets;
};

/// Adds pictures up, one at a time; the result depends on their order in the last bits only.
class SphereLightSum {
 public:
  explicit SphereLightSum(std::shared_ptr<const FacetSphere> sphere);

  void add(const SkyPicture& picture);
  SphereLight result() const;

 private:
  struct Sum {
    double weight = 0, clipped = 0, known_sky = 0, open = 0;
    std::int64_t pixels = 0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero(), second = Eigen::Vector3d::Zero();
    double luminance_second = 0, peak = 0;
    Eigen::Vector3d bright = Eigen::Vector3d::Zero();
  };
  struct Total : Sum {
    double coverage = 0, between_weight = 0, between_first = 0, between_second = 0;
    int pictures = 0;
  };
  void add_pixel(const SkyPicture& picture, int x, int y, int samples);
  void fold();

  std::shared_ptr<const FacetSphere> sphere_;
  std::vector<Sum> picture_;
  std::vector<int> touched_;
  std::vector<Total> total_;
  int last_facet_ = 0;
};

}  // namespace roxel

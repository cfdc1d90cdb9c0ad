#include "roxel/sky/sky_masks.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/angles.h"
#include "roxel/base/formatted.h"

namespace roxel {
namespace {

constexpr double kNearSunDeg = 3, kGlareDeg = 10;
constexpr double kBorneOut = 0.8;   ///< share of the surest region that must pass a mask for it to be used
constexpr double kSureShare = 0.1;  ///< of the surest region's area: others need not be doubted
constexpr double kLeastRegion =
    0.0015;  ///< steradians: smaller regions are windows and gaps (5 square degrees)

struct Region {
  std::vector<int> facets;
  double area = 0, height = 0;  ///< height: area x sine of elevation
  double blue = 0, bright = 0;  ///< area that passes the masks
  double open = 0;              ///< area where a volume knows of nothing
};

class Masking {
 public:
  Masking(const SphereLight& light, const std::optional<Eigen::Vector3d>& sun, const SkyMaskOptions& options)
      : light_(light), sphere_(*light.sphere), sun_(sun), options_(options) {}

  SkyMasks take() {
    const std::size_t count = light_.facets.size();
    for (auto* mask :
         {&out_.unusable, &out_.variance, &out_.red_blue, &out_.luminance, &out_.near_sun, &out_.sky})
      mask->assign(count, 0);
    find_mean();
    for (int f = 0; f < sphere_.count(); ++f) mask_facet(f);
    if (known_by_hand()) return std::move(out_);
    find_regions();
    choose();
    return std::move(out_);
  }

 private:
  bool within_sun(int f, double degrees) const {
    return sun_ && sphere_.centre(f).dot(*sun_) > std::cos(degrees * kDegree);
  }

  /// Of all that is seen, also below the horizon; the sun's pixels are ten thousand times brighter.
  void find_mean() {
    double sum = 0, weight = 0;
    for (int f = 0; f < sphere_.count(); ++f) {
      const FacetLight& facet = light_.facets[f];
      if (!(facet.weight > 0) || within_sun(f, kGlareDeg)) continue;
      const double area = sphere_.solid_angle(f) * facet.coverage;
      sum += area * luminance(facet.mean), weight += area;
    }
    out_.mean_luminance = weight > 0 ? sum / weight : 0;
  }

  void mask_facet(int f) {
    const FacetLight& facet = light_.facets[f];
    const double light = luminance(facet.mean);
    const bool clipped = facet.clipped > 0.1 * (facet.weight + facet.clipped);
    const bool below = sphere_.centre(f).z() <= std::sin(options_.lowest_elevation_deg * kDegree);
    out_.unusable[f] =
        below || clipped || facet.coverage < options_.least_coverage || !(facet.mean.minCoeff() > 0);
    out_.variance[f] = facet.contrast > options_.contrast_limit;
    out_.red_blue[f] = !(facet.mean[0] < options_.red_blue_limit * facet.mean[2]);
    out_.luminance[f] = !(light >= out_.mean_luminance);
    out_.near_sun[f] = within_sun(f, kNearSunDeg);
  }

  bool known_by_hand() {
    double known = 0;
    for (const FacetLight& facet : light_.facets) known += facet.known_sky;
    if (!(known > 0)) return false;
    for (int f = 0; f < sphere_.count(); ++f) {
      const FacetLight& facet = light_.facets[f];
      out_.sky[f] =
          !out_.unusable[f] && !out_.near_sun[f] && facet.known_sky > 0.9 * (facet.weight + facet.clipped);
    }
    out_.reason = "masks by hand say what is sky";
    return true;
  }

  bool smooth(int f) const { return !out_.unusable[f] && !out_.variance[f] && !out_.near_sun[f]; }

  /// Smooth facets that hang together without a step of brightness between them.
  void find_regions() {
    std::vector<std::uint8_t> taken(light_.facets.size());
    for (int seed = 0; seed < sphere_.count(); ++seed) {
      if (taken[seed] || !smooth(seed)) continue;
      Region region{{seed}};
      taken[seed] = 1;
      for (std::size_t i = 0; i < region.facets.size(); ++i) {
        const int here = region.facets[i];
        const double light = std::log(luminance(light_.facets[here].mean));
        for (const int next : sphere_.neighbours(here))
          if (!taken[next] && smooth(next) &&
              std::abs(std::log(luminance(light_.facets[next].mean)) - light) < options_.step_limit)
            taken[next] = 1, region.facets.push_back(next);
      }
      measure(region);
      if (region.area >= kLeastRegion) regions_.push_back(std::move(region));
    }
  }

  void measure(Region& region) const {
    for (const int f : region.facets) {
      const double area = sphere_.solid_angle(f);
      region.area += area;
      region.height += area * sphere_.centre(f).z();
      if (!out_.red_blue[f]) region.blue += area;
      if (!out_.luminance[f]) region.bright += area;
      if (is_open(light_.facets[f])) region.open += area;
    }
  }

  /// Large, high, blue, bright: what is most of that is surely sky.
  static double likeness(const Region& r) {
    return r.height * (0.1 + r.blue / r.area) * (0.1 + r.bright / r.area);
  }

  void choose() {
    const Region* surest = nullptr;
    for (const Region& region : regions_)
      if (!surest || likeness(region) > likeness(*surest)) surest = &region;
    if (!surest) {
      out_.reason = "nothing smooth above the horizon";
      return;
    }
    out_.red_blue_share = surest->blue / surest->area;
    out_.luminance_share = surest->bright / surest->area;
    out_.red_blue_used = out_.red_blue_share >= kBorneOut;
    out_.luminance_used = out_.luminance_share >= kBorneOut;
    out_.reason = formatted(
        "of the largest smooth region high up, %.0f %% is blue (red over blue %s) and %.0f %% brighter than "
        "the mean "
        "(luminance %s)",
        100 * out_.red_blue_share, out_.red_blue_used ? "used" : "left out", 100 * out_.luminance_share,
        out_.luminance_used ? "used" : "left out");
    if (!out_.red_blue_used && !out_.luminance_used) return;  // neither blue nor bright: no sky
    for (const Region& region : regions_) {
      const bool blue = !out_.red_blue_used || region.blue >= kBorneOut * region.area;
      const bool bright = !out_.luminance_used || region.bright >= kBorneOut * region.area;
      if (region.open >= kBorneOut * region.area) {  // nothing else is there
        for (const int f : region.facets) out_.sky[f] = 1;
        continue;
      }
      // A region that is much smaller is a wall or a window until the fit says otherwise.
      if (!blue || !bright) continue;
      if (region.area > kSureShare * surest->area)
        for (const int f : region.facets) out_.sky[f] = 1;
      else
        out_.apart.push_back(region.facets);
    }
  }

  const SphereLight& light_;
  const FacetSphere& sphere_;
  std::optional<Eigen::Vector3d> sun_;
  const SkyMaskOptions& options_;
  std::vector<Region> regions_;
  SkyMasks out_;
};

}  // namespace

SkyMasks sky_masks(const SphereLight& light, const std::optional<Eigen::Vector3d>& sun,
                   const SkyMaskOptions& options) {
  return Masking(light, sun, options).take();
}

}  // namespace roxel

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
/// Share of what is seen above the middle of a clipped patch that is the patch: below it, it is a wall that
/// shines.
constexpr double kHighUp = 0.25;
constexpr double kGoesOn = 0.5;  ///< of the level that clips, beside clipped sky
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
    const bool clipped = clipped_share(facet) > kClippedShare;
    const bool below = sphere_.centre(f).z() <= std::sin(options_.lowest_elevation_deg * kDegree);
    out_.unusable[f] =
        below || clipped || facet.coverage < options_.least_coverage || !(facet.mean.minCoeff() > 0);
    out_.variance[f] = facet.contrast > options_.contrast_limit;
    out_.red_blue[f] = !(facet.mean[0] < options_.red_blue_limit * facet.mean[2]);
    out_.luminance[f] = !(light >= out_.mean_luminance);
    out_.near_sun[f] = within_sun(f, kNearSunDeg);
  }

  bool known_by_hand() {
    if (light_.masked_by_hand == 0) return false;
    for (int f = 0; f < sphere_.count(); ++f) {
      const FacetLight& facet = light_.facets[f];
      out_.sky[f] = !out_.unusable[f] && !out_.near_sun[f] && is_known_sky(facet);
      if (!out_.near_sun[f] && white(f) && is_known_sky(facet)) out_.white.push_back(f);
    }
    out_.by_hand = true;
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

  bool white(int f) const {
    return sphere_.centre(f).z() > std::sin(options_.lowest_elevation_deg * kDegree) && !out_.near_sun[f] &&
           light_.facets[f].coverage >= options_.least_coverage &&
           clipped_share(light_.facets[f]) > kClippedShare;
  }

  /// The clipped patch with most height, if it is higher up than what else is seen.
  Region highest_white() const {
    std::vector<std::uint8_t> taken(light_.facets.size());
    Region best;
    for (int seed = 0; seed < sphere_.count(); ++seed) {
      if (taken[seed] || !white(seed)) continue;
      Region region{{seed}};
      taken[seed] = 1;
      for (std::size_t i = 0; i < region.facets.size(); ++i)
        for (const int next : sphere_.neighbours(region.facets[i]))
          if (!taken[next] && white(next)) taken[next] = 1, region.facets.push_back(next);
      measure(region);
      if (region.height > best.height) best = std::move(region);
    }
    return best.area > 0 && high_up(best) ? best : Region{};
  }

  bool high_up(const Region& region) const {
    double here = 0, all = 0;
    for (const int f : region.facets)
      if (sphere_.centre(f).z() > region.height / region.area) here += sphere_.solid_angle(f);
    for (int f = 0; f < sphere_.count(); ++f)
      if (sphere_.centre(f).z() > region.height / region.area &&
          light_.facets[f].coverage >= options_.least_coverage)
        all += sphere_.solid_angle(f);
    return here > kHighUp * all;
  }

  /// Where the sky clips, what is smooth below it is sky only if it goes on from there.
  void keep_what_touches_white() {
    std::vector<double> clip_beside(light_.facets.size(), std::numeric_limits<double>::infinity());
    for (const int f : out_.white)
      for (const int next : sphere_.neighbours(f)) clip_beside[next] = light_.facets[f].clip;
    std::erase_if(regions_, [&](const Region& region) {
      return std::none_of(region.facets.begin(), region.facets.end(),
                          [&](int f) { return light_.facets[f].mean.maxCoeff() > kGoesOn * clip_beside[f]; });
    });
  }

  void choose() {
    Region white = highest_white();
    if (std::none_of(regions_.begin(), regions_.end(),
                     [&](const Region& region) { return region.height >= white.height; })) {
      out_.white = std::move(white.facets);
      keep_what_touches_white();
    }
    const Region* surest = nullptr;
    for (const Region& region : regions_)
      if (!surest || likeness(region) > likeness(*surest)) surest = &region;
    if (!surest) {
      out_.reason = out_.white.empty() ? "nothing smooth above the horizon" : "what is high up clips";
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
      if (region.open >= kBorneOut * region.area) out_.unexplained.push_back(region.facets);
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

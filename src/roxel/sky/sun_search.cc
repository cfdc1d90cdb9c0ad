#include "roxel/sky/sun_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "roxel/base/angles.h"
#include "roxel/base/median.h"

namespace roxel {
namespace {

constexpr double kLeastContrast = 12;
constexpr double kWidestPatchDeg = 20;  ///< radius
/// Of the rings around a sun: roofs may hide half, the pictures' edges hardly any.
constexpr double kAmidSky = 0.4, kSkyAway = 0.3, kAllInView = 0.9;
/// Brightness of the sky beside a sun over that further away: 1.7 to 2.8 on courtyard's photographs of 8 bits
/// up to four times its exposure, and up to 1.7 beside walls, where it is horizon that is brighter.
constexpr double kGlare = 1.7;
constexpr double kClusterDeg = 3;
constexpr double kLowestSunSine = -0.02;

double median_luminance(const SphereLight& light) {
  std::vector<double> values;
  for (std::size_t f = 0; f < light.facets.size(); ++f)
    if (light.facets[f].weight > 0 && light.sphere->centre(static_cast<int>(f)).z() > 0)
      values.push_back(luminance(light.facets[f].mean));
  return median(values);
}

bool is_clipped(const FacetLight& facet) { return facet.clipped > facet.weight; }

bool holds_clipped(const FacetLight& facet) { return facet.clipped > 0; }

/// The facets that hang together with `seed` and clip; `seen` remembers them.
std::vector<int> clipped_patch(const SphereLight& light, int seed, bool (*clips)(const FacetLight&),
                               std::vector<bool>& seen) {
  std::vector<int> patch{seed};
  seen[seed] = true;
  for (std::size_t i = 0; i < patch.size(); ++i)
    for (const int next : light.sphere->neighbours(patch[i]))
      if (!seen[next] && clips(light.facets[next])) seen[next] = true, patch.push_back(next);
  return patch;
}

FoundSun sun_of_patch(const SphereLight& light, const std::vector<int>& patch) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const int f : patch) middle += light.facets[f].bright;
  FoundSun sun{middle.normalized(), 0, 0, true, 0};
  for (const int f : patch)
    sun.radius_deg =
        std::max(sun.radius_deg,
                 std::acos(std::clamp(sun.direction.dot(light.sphere->centre(f)), -1.0, 1.0)) / kDegree);
  return sun;
}

/// All patches that are small enough to be the sun and its glare, largest first.
std::vector<FoundSun> clipped_patches(const SphereLight& light, bool (*clips)(const FacetLight&)) {
  std::vector<bool> seen(light.facets.size());
  std::vector<std::pair<std::size_t, FoundSun>> patches;
  for (int f = 0; f < light.sphere->count(); ++f) {
    if (seen[f] || !clips(light.facets[f])) continue;
    const std::vector<int> patch = clipped_patch(light, f, clips, seen);
    const FoundSun sun = sun_of_patch(light, patch);
    if (sun.radius_deg <= kWidestPatchDeg && sun.direction.z() >= kLowestSunSine)
      patches.emplace_back(patch.size(), sun);
  }
  std::stable_sort(patches.begin(), patches.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<FoundSun> sorted;
  for (const auto& patch : patches) sorted.push_back(patch.second);
  return sorted;
}

}  // namespace

std::vector<FoundSun> bright_spots(const SphereLight& light) {
  const double median = median_luminance(light);
  int brightest = -1;
  for (int f = 0; f < light.sphere->count(); ++f)
    if (light.sphere->centre(f).z() > kLowestSunSine && light.facets[f].peak > 0 &&
        (brightest < 0 || light.facets[f].peak > light.facets[brightest].peak))
      brightest = f;
  if (brightest < 0) return {};
  const double peak = light.facets[brightest].peak;
  const double contrast = median > 0 ? peak / median : 0;
  std::vector<FoundSun> spots;
  if (light.facets[brightest].clipped > 0) {
    spots = clipped_patches(light, is_clipped);
    const std::vector<FoundSun> small = clipped_patches(light, holds_clipped);
    spots.insert(spots.end(), small.begin(), small.end());
  }
  for (FoundSun& spot : spots) spot.contrast = contrast, spot.peak = peak;
  if (!(contrast >= kLeastContrast)) return spots;
  // The facet's own middle of light first, then all light around it.
  const Eigen::Vector3d start = light.facets[brightest].bright.normalized();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (int f = 0; f < light.sphere->count(); ++f)
    if (light.facets[f].peak > 0.05 * peak &&
        light.sphere->centre(f).dot(start) > std::cos(kClusterDeg * kDegree))
      middle += light.facets[f].bright;
  spots.push_back({middle.normalized(), contrast, peak, light.facets[brightest].clipped > 0, kClusterDeg});
  return spots;
}

SkyRing sky_ring(const SphereLight& light, const std::vector<std::uint8_t>& sky,
                 const Eigen::Vector3d& direction, double inner_deg, double outer_deg) {
  const double nearest = std::cos(inner_deg * kDegree), farthest = std::cos(outer_deg * kDegree);
  SkyRing ring;
  double around = 0, above = 0, seen = 0, of_sky = 0, measured = 0;
  for (int f = 0; f < light.sphere->count(); ++f) {
    const double cosine = light.sphere->centre(f).dot(direction), area = light.sphere->solid_angle(f);
    if (cosine > nearest || cosine < farthest) continue;
    around += area;
    if (light.sphere->centre(f).z() > 0) above += area, seen += area * light.facets[f].coverage;
    if (!sky[f]) continue;
    of_sky += area;
    if (light.facets[f].weight > 0)
      measured += area, ring.luminance += area * luminance(light.facets[f].mean);
  }
  if (around > 0) ring.sky_share = of_sky / around;
  if (above > 0) ring.seen_share = seen / above;
  if (measured > 0) ring.luminance /= measured;
  return ring;
}

bool glares(const SphereLight& light, const std::vector<std::uint8_t>& sky, const FoundSun& spot) {
  const SkyRing beside = sky_ring(light, sky, spot.direction, spot.radius_deg + 1, spot.radius_deg + 5),
                away = sky_ring(light, sky, spot.direction, spot.radius_deg + 10, spot.radius_deg + 20);
  return beside.seen_share > kAllInView && beside.sky_share > kAmidSky && away.sky_share > kSkyAway &&
         beside.luminance > kGlare * away.luminance;
}

SunMeasure measure_sun(const SkyPicture& picture, const Eigen::Vector3d& sun) {
  SunMeasure measure;
  const PixelRays& rays = picture.rays;
  const double radius = std::max(1.2 * kDegree, 4 * rays.pixel_angle());
  const auto at = rays.position(sun);
  if (!at || at->x() < 0 || at->y() < 0 || at->x() > rays.width() || at->y() > rays.height()) return measure;
  const PixelRange range = rays.around(sun, 2 * radius);
  double inner = 0, ring = 0, peak = 0;
  Eigen::Vector3d inner_light = Eigen::Vector3d::Zero(), ring_light = Eigen::Vector3d::Zero();
  for (int y = range.y0; y < range.y1; ++y)
    for (int column = range.x0; column < range.x1; ++column) {
      const int x = (column + rays.width()) % rays.width();
      const double angle = std::acos(std::clamp(rays.direction(x + 0.5, y + 0.5).dot(sun), -1.0, 1.0));
      if (angle > 2 * radius) continue;
      const Eigen::Vector3d rgb = Eigen::Vector3f(picture.rgb.pixel(x, y)).cast<double>();
      const double weight = rays.solid_angle(x, y);
      if (angle < radius) {
        if (rgb.maxCoeff() >= picture.clip) measure.clipped = true;
        inner += weight, inner_light += weight * rgb, peak = std::max(peak, luminance(rgb));
      } else {
        ring += weight, ring_light += weight * rgb;
      }
    }
  const double cap = 2 * std::numbers::pi * (1 - std::cos(radius)),
               wide = 2 * std::numbers::pi * (1 - std::cos(2 * radius));
  measure.in_view = inner > 0.95 * cap && ring > 0.9 * (wide - cap);
  if (!measure.in_view) return measure;
  const Eigen::Vector3d around = ring_light / ring;
  measure.shines = peak > 20 * luminance(around) || measure.clipped;
  if (measure.shines) measure.irradiance = (inner_light - inner * around).cwiseMax(Eigen::Vector3d::Zero());
  return measure;
}

}  // namespace roxel

#include "roxel/eval/true_light.h"

#include <numbers>

#include "roxel/sky/facet_sphere.h"
#include "roxel/sky/sky_picture.h"

namespace roxel {
namespace {

constexpr int kLevel = 3;       ///< 512 facets, of 9 degrees
constexpr double kSame = 2e-3;  ///< relative distance at which a ray's hit is the place asked for
constexpr double kGrey = 0.3;   ///< albedo of what gives light back
constexpr double kLift = 1e-3;  ///< share of the distance from the eye by which rays start above a surface

std::vector<Eigen::Vector3d> through_facets(const Image& map) {
  const auto sphere = FacetSphere::of_level(kLevel);
  const Equirectangular frame{map.width(), map.height()};
  const PixelRays rays(frame);
  std::vector<Eigen::Vector3d> sums(sphere->count(), Eigen::Vector3d::Zero());
  std::vector<double> areas(sphere->count(), 0);
  for (int y = 0; y < map.height(); ++y)
    for (int x = 0; x < map.width(); ++x) {
      const Eigen::Vector3d direction = frame.direction(x + 0.5, y + 0.5);
      const int facet = sphere->facet_at(direction);
      const double area = rays.solid_angle(x, y);
      areas[facet] += area;
      if (direction.z() > 0) sums[facet] += area * Eigen::Vector3f(map.pixel(x, y)).cast<double>();
    }
  for (int f = 0; f < sphere->count(); ++f)
    if (areas[f] > 0) sums[f] /= areas[f];
  return sums;
}

}  // namespace

TrueLight::TrueLight(const Mesh& surface, const std::vector<TrueSky>& skies)
    : surface_(surface), rays_(surface), skies_(skies) {
  const auto sphere = FacetSphere::of_level(kLevel);
  for (const TrueSky& sky : skies) {
    radiance_.push_back(through_facets(sky.map));
    flat_.push_back(Eigen::Vector3d::Zero());
    for (int f = 0; f < sphere->count(); ++f)
      flat_.back() += std::max(0.0, sphere->centre(f).z()) * sphere->solid_angle(f) / std::numbers::pi *
                      radiance_.back()[f];
  }
}

Eigen::Vector3d TrueLight::facing_normal(const MeshHit& hit, const Eigen::Vector3d& direction) const {
  const auto& corners = surface_.triangles[hit.triangle];
  const Eigen::Vector3d a = surface_.points[corners[0]], b = surface_.points[corners[1]],
                        c = surface_.points[corners[2]];
  const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
  return normal.dot(direction) > 0 ? Eigen::Vector3d(-normal) : normal;
}

Eigen::Vector3d TrueLight::sunlight(std::size_t sky, const Eigen::Vector3d& from,
                                    const Eigen::Vector3d& normal) const {
  const double cosine = normal.dot(skies_[sky].sun);
  const bool shines = cosine > 0 && skies_[sky].sun_irradiance[1] > 0 && !rays_.trace(from, skies_[sky].sun);
  return (shines ? cosine / std::numbers::pi : 0.0) * skies_[sky].sun_irradiance;
}

std::vector<Eigen::Vector3d> TrueLight::at(const Eigen::Vector3d& x, const Eigen::Vector3d& eye) const {
  const auto hit = rays_.trace(eye, x - eye);
  if (!hit || std::abs(hit->distance - 1) > kSame) return {};
  const double lift = kLift * (eye - x).norm();
  const Eigen::Vector3d normal = facing_normal(*hit, x - eye), from = x + lift * normal;
  std::vector<Eigen::Vector3d> light;
  for (std::size_t s = 0; s < skies_.size(); ++s) light.push_back(sunlight(s, from, normal));
  const auto sphere = FacetSphere::of_level(kLevel);
  for (int f = 0; f < sphere->count(); ++f) {
    const Eigen::Vector3d& direction = sphere->centre(f);
    const double share = normal.dot(direction) * sphere->solid_angle(f) / std::numbers::pi;
    if (share <= 0) continue;
    const auto behind = rays_.trace(from, direction);
    const Eigen::Vector3d there = behind ? facing_normal(*behind, direction) : Eigen::Vector3d::Zero();
    for (std::size_t s = 0; s < skies_.size(); ++s) {
      if (!behind) {
        light[s] += share * radiance_[s][f];
        continue;
      }
      const Eigen::Vector3d place = from + behind->distance * direction + lift * there;
      light[s] += share * kGrey * (0.5 * flat_[s] + sunlight(s, place, there));
    }
  }
  return light;
}

}  // namespace roxel

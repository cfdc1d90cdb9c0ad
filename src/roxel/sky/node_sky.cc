#include "roxel/sky/node_sky.h"

#include <numbers>

#include "roxel/base/angles.h"
#include "roxel/base/error.h"
#include "roxel/sky/facet_sphere.h"
#include "roxel/sky/sky_picture.h"

namespace roxel {
namespace {

constexpr int kQuadratureLevel = 5;  ///< 4096 directions of the dome

/// Associated Legendre function P_l^m(x) without the sign (-1)^m, by the usual recurrences.
double legendre(int l, int m, double x) {
  double p_mm = 1;
  for (int i = 1; i <= m; ++i) p_mm *= (2 * i - 1) * std::sqrt(std::max(0.0, 1 - x * x));
  if (l == m) return p_mm;
  double p = x * (2 * m + 1) * p_mm;
  for (int k = m + 2; k <= l; ++k) {
    const double next = (x * (2 * k - 1) * p - (k + m - 1) * p_mm) / (k - m);
    p_mm = p, p = next;
  }
  return p;
}

double factorial(int n) { return n < 2 ? 1 : n * factorial(n - 1); }

}  // namespace

const char* to_string(SkyModel model) {
  switch (model) {
    case SkyModel::kNone:
      return "none";
    case SkyModel::kUniform:
      return "uniform";
    case SkyModel::kPublished:
      return "published";
    case SkyModel::kGradation:
      return "gradation";
    case SkyModel::kPerez:
      return "perez";
  }
  return "?";
}

const char* to_string(SunSource source) {
  switch (source) {
    case SunSource::kNone:
      return "none";
    case SunSource::kTime:
      return "time";
    case SunSource::kImages:
      return "images";
    case SunSource::kGiven:
      return "given";
  }
  return "?";
}

const char* to_string(SunLight light) {
  switch (light) {
    case SunLight::kNone:
      return "none";
    case SunLight::kMeasured:
      return "measured";
    case SunLight::kEstimated:
      return "estimated";
  }
  return "?";
}

std::vector<double> spherical_functions(int order, const Eigen::Vector3d& d) {
  ROXEL_CHECK_GE(order, 0);
  ROXEL_CHECK_LE(order, 4);
  std::vector<double> values;
  const double azimuth = std::atan2(d.y(), d.x());
  for (int l = 0; l <= order; ++l)
    for (int m = -l; m <= l; ++m) {
      const int k = std::abs(m);
      const double norm = std::sqrt((2 * l + 1) / (4 * kPi) * factorial(l - k) / factorial(l + k));
      const double turn =
          m == 0 ? 1 : std::numbers::sqrt2 * (m > 0 ? std::cos(k * azimuth) : std::sin(k * azimuth));
      values.push_back(norm * turn * legendre(l, k, d.z()));
    }
  return values;
}

Eigen::Vector3d NodeSky::radiance_in_sky(const Eigen::Vector3d& direction) const {
  if (!has_light()) return Eigen::Vector3d::Zero();
  Eigen::Vector3d seen;
  for (int c = 0; c < 3; ++c) seen[c] = channels[c].scale * perez_relative(channels[c].shape, direction, sun);
  if (residual_order > 0) {
    const std::vector<double> functions = spherical_functions(residual_order, direction);
    for (int c = 0; c < 3; ++c) {
      double log_factor = 0;
      for (std::size_t i = 0; i < functions.size(); ++i) log_factor += residual[c][i] * functions[i];
      seen[c] *= std::exp(log_factor);
    }
  }
  return seen;
}

Eigen::Vector3d NodeSky::radiance(const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d in_sky = sky_from_world * direction;
  return in_sky.z() < 0 ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : radiance_in_sky(in_sky);
}

SkyLight::SkyLight(const NodeSky& sky)
    : up_(sky.sky_from_world.transpose() * Eigen::Vector3d::UnitZ()),
      sun_(sky.sun_in_world()),
      sun_irradiance_(sky.sun_light == SunLight::kNone ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                                       : sky.sun_irradiance) {
  const auto sphere = FacetSphere::of_level(kQuadratureLevel);
  for (int f = 0; f < sphere->count(); ++f) {
    if (sphere->centre(f).z() <= 0) continue;
    directions_.push_back(sky.sky_from_world.transpose() * sphere->centre(f));
    light_.push_back(sky.radiance_in_sky(sphere->centre(f)) * sphere->solid_angle(f));
  }
}

Eigen::Vector3d SkyLight::irradiance(const Eigen::Vector3d& normal, Disc disc) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < light_.size(); ++i)
    sum += std::max(0.0, directions_[i].dot(normal)) * light_[i];
  if (disc == Disc::kWith && sun_.dot(up_) > 0) sum += std::max(0.0, sun_.dot(normal)) * sun_irradiance_;
  return sum;
}

Eigen::Vector3d SkyLight::horizontal_irradiance(Disc disc) const { return irradiance(up_, disc); }

Eigen::Vector3d SkyLight::canonical_light(Disc disc) const { return horizontal_irradiance(disc) / kPi; }

Eigen::Vector3d SkyLight::mean_radiance(Disc disc) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& light : light_) sum += light;
  if (disc == Disc::kWith && sun_.dot(up_) > 0) sum += sun_irradiance_;
  return sum / (2 * kPi);
}

namespace {

/// Adds light of `irradiance` from the pixels near the sun, the same radiance from each.
void add_disc(const NodeSky& sky, const Equirectangular& frame, Image& map) {
  constexpr double kDiscRadius = 0.2725 * kPi / 180;
  const double radius = std::max(kDiscRadius, 0.75 * kPi / map.height());
  const PixelRays rays(frame);
  std::vector<std::pair<int, int>> covered;
  double area = 0;
  for (int y = 0; y < map.height(); ++y)
    for (int x = 0; x < map.width(); ++x)
      if (frame.direction(x + 0.5, y + 0.5).dot(sky.sun) > std::cos(radius))
        covered.emplace_back(x, y), area += rays.solid_angle(x, y);
  for (const auto& [x, y] : covered)
    for (int c = 0; c < 3; ++c) map.pixel(x, y)[c] += static_cast<float>(sky.sun_irradiance[c] / area);
}

}  // namespace

Image sky_map(const NodeSky& sky, Disc disc, int width, int height) {
  const Equirectangular frame{width, height};
  Image map(width, height, 3);
  for (int y = 0; 2 * y + 1 < height; ++y)
    for (int x = 0; x < width; ++x)
      Eigen::Map<Eigen::Vector3f>(map.pixel(x, y)) =
          sky.radiance_in_sky(frame.direction(x + 0.5, y + 0.5)).cast<float>();
  if (disc == Disc::kWith && sky.sun_light != SunLight::kNone) add_disc(sky, frame, map);
  return map;
}

}  // namespace roxel

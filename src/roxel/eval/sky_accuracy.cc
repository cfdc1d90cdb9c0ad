#include "roxel/eval/sky_accuracy.h"

#include <cmath>
#include <numbers>

#include "roxel/base/error.h"
#include "roxel/sky/perez_fit.h"
#include "roxel/sky/sphere_light.h"

namespace roxel {

double dome_error(const Image& ours, const Image& truth) {
  ROXEL_CHECK_EQ(ours.width(), truth.width());
  ROXEL_CHECK_EQ(ours.height(), truth.height());
  const PixelRays rays(Equirectangular{truth.width(), truth.height()});
  double error = 0, weight = 0;
  for (int y = 0; 2 * y + 1 < truth.height(); ++y) {
    const double area = rays.solid_angle(0, y);
    for (int x = 0; x < truth.width(); ++x)
      for (int c = 0; c < 3; ++c) {
        if (!(truth.pixel(x, y)[c] > 0)) continue;
        error += area * std::abs(ours.pixel(x, y)[c] / truth.pixel(x, y)[c] - 1.0);
        weight += area;
      }
  }
  return weight > 0 ? error / weight : 0;
}

double oracle_dome_error(const Image& truth, const Eigen::Vector3d& sun, PerezFreedom freedom) {
  SphereLightSum sum(FacetSphere::of_level(5));
  sum.add({truth, {}, {}, PixelRays(Equirectangular{truth.width(), truth.height()})});
  const SphereLight light = sum.result();
  std::vector<SkySample> samples;
  for (int f = 0; f < light.sphere->count(); ++f)
    if (light.sphere->centre(f).z() > 0 && light.facets[f].mean.minCoeff() > 0)
      samples.push_back({light.sphere->centre(f), light.facets[f].mean, light.sphere->solid_angle(f)});
  if (samples.empty()) return 0;
  NodeSky sky;
  sky.model = SkyModel::kPerez;
  sky.sun = sun;
  PerezFitOptions options;
  options.freedom = freedom;
  options.starts = published_starts(sun);
  for (int c = 0; c < 3; ++c) sky.channels[c] = fit_perez(samples, c, sun, options).channel;
  return dome_error(sky_map(sky, Disc::kWithout, truth.width(), truth.height()), truth);
}

void MaskAgreement::add(const Mask& sky, const Mask& surface) {
  ROXEL_CHECK_EQ(sky.width(), surface.width());
  ROXEL_CHECK_EQ(sky.height(), surface.height());
  for (std::size_t i = 0; i < sky.data().size(); ++i) {
    const bool ours = sky.data()[i] >= 128, truth = surface.data()[i] < 128;
    both += ours && truth;
    either += ours || truth;
  }
}

double angle_between_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0)) * 180 / std::numbers::pi;
}

}  // namespace roxel

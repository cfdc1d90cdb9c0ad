#include "roxel/solve/surface_light.h"

#include "roxel/base/angles.h"
#include "roxel/base/parallel.h"
#include "roxel/march/obstruction.h"
#include "roxel/sky/facet_sphere.h"
#include "roxel/volume/surface_axes.h"

namespace roxel {
namespace {

constexpr std::int64_t kLightGrain = 256;  ///< places
constexpr int kAround = 2;                 ///< facets that the dome is looked at through: 128, of 18 degrees
constexpr int kQuadrature = 5;             ///< facets that their radiance is the mean of
/// Rays leave a surface from this many voxels above it: its own voxels, two or three thick and never quite
/// flat, must not hide it.
constexpr double kLift = 1.5;
/// No place is darker than this share of open ground: where the volume says so, its normal is wrong or it is
/// closed by mistake.
constexpr float kDarkestPlace = 0.03f;

/// A sky's radiance through each facet of the level kAround, world directions.
std::vector<Rgb> radiance_through_facets(const NodeSky& sky, double unit) {
  const auto coarse = FacetSphere::of_level(kAround), fine = FacetSphere::of_level(kQuadrature);
  std::vector<Eigen::Vector3d> sums(coarse->count(), Eigen::Vector3d::Zero());
  for (int f = 0; f < fine->count(); ++f)
    sums[coarse->facet_at(fine->centre(f))] += fine->solid_angle(f) * sky.radiance(fine->centre(f));
  std::vector<Rgb> radiance(coarse->count());
  for (int f = 0; f < coarse->count(); ++f)
    for (int c = 0; c < 3; ++c)
      radiance[f][c] = static_cast<float>(sums[f][c] / coarse->solid_angle(f) / unit);
  return radiance;
}

Rgb scaled(const Eigen::Vector3d& light, double unit) {
  return {static_cast<float>(light[0] / unit), static_cast<float>(light[1] / unit),
          static_cast<float>(light[2] / unit)};
}

}  // namespace

SurfaceVoxels surface_voxels(const Volume& volume, float least_opacity,
                             const std::vector<Eigen::Vector3f>& towards, int threads) {
  SurfaceVoxels found;
  found.places.assign(volume.slot_count(), -1);
  const float least_tau = tau_from_alpha(least_opacity);
  const BrickIndex& index = volume.index(0);
  for (const Brick& brick : index.bricks())
    brick.for_each_voxel([&](int v, std::uint32_t slot) {
      if (!(volume.tau[slot] >= least_tau)) return;
      found.places[slot] = static_cast<std::int32_t>(found.slots.size());
      found.slots.push_back(slot);
      found.centres.push_back(index.frame().voxel_centre(voxel_of(brick, v)));
    });
  const std::vector<Eigen::Vector3f> axes = surface_axes(volume, threads);
  for (const std::uint32_t slot : found.slots)
    found.normals.push_back(axes[slot].dot(towards[slot]) < 0 ? Eigen::Vector3f(-axes[slot]) : axes[slot]);
  return found;
}

SurfaceLight::SurfaceLight(const LatticeStack& stack, SurfaceVoxels voxels, const Daylight& light_of_day,
                           const RunContext& context)
    : voxels_(std::move(voxels)) {
  const double unit = mean_light(light_of_day);
  for (const NodeSky& sky : light_of_day.skies) {
    const bool shines = sky.has_light() && sky.sun_light != SunLight::kNone && sky.sun.z() > 0;
    flat_.push_back(sky.has_light() ? scaled(SkyLight(sky).canonical_light(), unit) : Rgb{1, 1, 1});
    sun_.push_back(shines ? scaled(sky.sun_irradiance / kPi, unit) : Rgb{0, 0, 0});
    to_sun_.push_back(sky.sun_in_world());
  }
  const std::size_t size = voxels_.count() * flat_.size();
  dome_.assign(size, {0, 0, 0});
  bounce_.assign(size, {0, 0, 0});
  sunlit_.assign(size, 0);
  hidden_.resize(voxels_.count());
  for (std::size_t v = 0; v < light_of_day.sky_of_views.size(); ++v)
    sky_of_views_.push_back(light_of_day.of_view(static_cast<int>(v)) ? light_of_day.sky_of_views[v] : -1);
  look_around(stack, light_of_day, context);
}

void SurfaceLight::look_around(const LatticeStack& stack, const Daylight& light_of_day,
                               const RunContext& context) {
  const auto sphere = FacetSphere::of_level(kAround);
  std::vector<std::vector<Rgb>> radiance;
  for (const NodeSky& sky : light_of_day.skies)
    radiance.push_back(radiance_through_facets(sky, mean_light(light_of_day)));
  const double lift = kLift * stack.volume().index(0).frame().voxel_size;
  const auto look_from = [&](std::size_t place, ObstructionMarch& march) {
    const Eigen::Vector3d normal = voxels_.normals[place].cast<double>();
    const Eigen::Vector3d from = voxels_.centres[place] + lift * normal;
    double all = 0;
    for (int f = 0; f < sphere->count(); ++f)
      all += std::max(0.0, normal.dot(sphere->centre(f))) * sphere->solid_angle(f);
    if (!(all > 0)) return;
    for (int f = 0; f < sphere->count(); ++f) {
      const double cosine = normal.dot(sphere->centre(f));
      if (cosine <= 0) continue;
      const auto share = static_cast<float>(cosine * sphere->solid_angle(f) / all);
      const Obstruction found = march.look(from, sphere->centre(f));
      for (int s = 0; s < sky_count(); ++s)
        for (int c = 0; c < 3; ++c)
          dome_[index(s, place)][c] += share * found.transmittance * radiance[s][f][c];
      const std::int32_t behind = found.at == kNoSlot ? -1 : voxels_.places[found.at];
      if (behind >= 0) hidden_[place].push_back({behind, share * (1 - found.transmittance)});
    }
    for (int s = 0; s < sky_count(); ++s)
      if (sun_[s][1] > 0 && normal.dot(to_sun_[s]) > 0)
        sunlit_[index(s, place)] = march.look(from, to_sun_[s]).transmittance;
  };
  parallel_for_blocks(static_cast<std::int64_t>(voxels_.count()), kLightGrain, context.thread_count(),
                      [&](std::int64_t begin, std::int64_t end, int) {
                        context.throw_if_cancelled();
                        ObstructionMarch march(stack);
                        for (std::int64_t place = begin; place < end; ++place)
                          look_from(static_cast<std::size_t>(place), march);
                      });
}

Rgb SurfaceLight::diffuse(int sky, std::size_t place) const {
  const std::size_t i = index(sky, place);
  Rgb light;
  if (voxels_.normals[place].isZero()) return flat_[sky];  // which way it looks is not known
  for (int c = 0; c < 3; ++c) light[c] = std::max(dome_[i][c] + bounce_[i][c], kDarkestPlace * flat_[sky][c]);
  return light;
}

Rgb SurfaceLight::sun(int sky, std::size_t place) const {
  const float cosine =
      std::max(0.0f, static_cast<float>(voxels_.normals[place].cast<double>().dot(to_sun_[sky])));
  return {cosine * sun_[sky][0], cosine * sun_[sky][1], cosine * sun_[sky][2]};
}

Rgb SurfaceLight::at(int sky, std::size_t place) const {
  Rgb light = diffuse(sky, place);
  const Rgb direct = sun(sky, place);
  for (int c = 0; c < 3; ++c) light[c] += sunlit(sky, place) * direct[c];
  return light;
}

Rgb SurfaceLight::of(int sky, std::uint32_t slot) const {
  if (sky < 0) return {1, 1, 1};
  const std::int32_t place = voxels_.places[slot];
  return place < 0 || voxels_.normals[place].isZero() ? flat_[sky] : at(sky, place);
}

void SurfaceLight::add_bounce(const std::vector<Rgb>& albedo, const RunContext& context) {
  std::vector<Rgb> given(dome_.size());
  for (std::size_t place = 0; place < voxels_.count(); ++place)
    for (int s = 0; s < sky_count(); ++s) {
      const Rgb light = at(s, place);
      for (int c = 0; c < 3; ++c) given[index(s, place)][c] = albedo[place][c] * light[c];
    }
  parallel_for_blocks(static_cast<std::int64_t>(voxels_.count()), kLightGrain, context.thread_count(),
                      [&](std::int64_t begin, std::int64_t end, int) {
                        for (std::int64_t p = begin; p < end; ++p)
                          for (int s = 0; s < sky_count(); ++s) {
                            Rgb& sum = bounce_[index(s, static_cast<std::size_t>(p))];
                            sum = {0, 0, 0};
                            for (const Hidden& hidden : hidden_[p])
                              for (int c = 0; c < 3; ++c)
                                sum[c] += hidden.weight * given[index(s, hidden.place)][c];
                          }
                      });
}

}  // namespace roxel

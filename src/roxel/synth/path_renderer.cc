#include "roxel/synth/path_renderer.h"

#include <cmath>
#include <limits>

#include "roxel/base/angles.h"
#include "roxel/base/error.h"
#include "roxel/synth/blend.h"
#include "roxel/synth/light_filter.h"
#include "roxel/synth/sample_stream.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

Vector2f on_disc(const Vector2f& random) {
  const float radius = std::sqrt(random.x()), turn = 2 * kPiFloat * random.y();
  return {radius * std::cos(turn), radius * std::sin(turn)};
}

/// A direction about the normal with density cos / pi: that of light on a diffuse surface.
Vector3f diffuse_direction(const Vector3f& normal, const Vector2f& random) {
  Vector3f u, v;
  frame_about(normal, u, v);
  const Vector2f d = on_disc(random);
  return d.x() * u + d.y() * v + std::sqrt(std::max(1 - d.squaredNorm(), 0.0f)) * normal;
}

/// Where a new ray starts: off the surface by more than rounding moves the point.
Vector3f above(const Vector3f& p, const Vector3f& normal) {
  return p + (2e-6f * p.cwiseAbs().maxCoeff() + 2e-5f) * normal;
}

std::uint8_t share(int count, int total) {
  return static_cast<std::uint8_t>(std::lround(255.0 * count / total));
}

}  // namespace

/// The random numbers of one pixel: even ones for the first light that is looked for, plain ones beyond.
struct PathRenderer::PixelSamples {
  SampleStream stream{0, 0, 0, 0};
  std::vector<Vector2f> sun, sky, around;
};

PathRenderer::PathRenderer(const RayScene& everything, const RayScene& lasting,
                           const std::vector<Texture>& materials, const Environment& environment,
                           const PathOptions& options)
    : everything_(everything),
      lasting_(lasting),
      materials_(materials),
      environment_(environment),
      options_(options),
      sampler_(environment) {
  ROXEL_CHECK_GE(options.samples, 1);
  ROXEL_CHECK_GE(options.bounces, 0);
  // An even sky is best found by the diffuse directions themselves.
  constexpr float kPeaked = 8;
  search_ = options.skylight            ? SkySearch::kOpening
            : sampler_.peak() > kPeaked ? SkySearch::kBrightParts
                                        : SkySearch::kByChance;
  frame_about(environment.sun().direction, sun_u_, sun_v_);
}

// Radiance over pi is what a white surface reflects; the caller multiplies by albedo.
Vector3f PathRenderer::sunlight(const Vector3f& p, const Vector3f& normal, const Vector2f& random) const {
  const Sun& sun = environment_.sun();
  if (sun.irradiance.isZero()) return Vector3f::Zero();
  const Vector2f d = std::tan(sun.angular_radius_rad) * on_disc(random);
  const Vector3f to_sun = (sun.direction + d.x() * sun_u_ + d.y() * sun_v_).normalized();
  const float facing = normal.dot(to_sun);
  if (facing <= 0 || everything_.occluded(p, to_sun, 0, std::numeric_limits<float>::infinity()))
    return Vector3f::Zero();
  return (facing / kPiFloat) * sun.irradiance;
}

// The sky is found in two ways, by directions that favour its bright parts and by diffuse ones; each light
// counts by the share that its way has in the density of both (the balance heuristic of [Veach97] 9.2.2).
Vector3f PathRenderer::skylight(const Vector3f& p, const Vector3f& normal, const Vector2f& random) const {
  const Vector3f direction = sampler_.direction(random);
  const float facing = normal.dot(direction);
  if (facing <= 0 || everything_.occluded(p, direction, 0, std::numeric_limits<float>::infinity()))
    return Vector3f::Zero();
  return (facing / kPiFloat) / (sampler_.density(direction) + facing / kPiFloat) *
         environment_.sky(direction);
}

// The same with points of the opening in place of bright directions.
Vector3f PathRenderer::light_from_above(const Vector3f& p, const Vector3f& normal,
                                        const Vector2f& random) const {
  const Skylight& opening = *options_.skylight;
  const Vector2f at = opening.extent.min() + opening.extent.sizes().cwiseProduct(random);
  const Vector3f way(at.x() - p.x(), at.y() - p.y(), opening.height - p.z());
  const Vector3f direction = way.normalized();
  const float facing = normal.dot(direction);
  if (facing <= 0 || way.z() <= 0 || everything_.occluded(p, way, 0, 1)) return Vector3f::Zero();
  return (facing / kPiFloat) / (opening_density(p, direction) + facing / kPiFloat) *
         environment_.sky(direction);
}

/// Probability a steradian that an even point of the opening lies in this direction.
float PathRenderer::opening_density(const Vector3f& p, const Vector3f& direction) const {
  const Skylight& opening = *options_.skylight;
  const float distance = (opening.height - p.z()) / direction.z();
  if (!(direction.z() > 0) || !(distance > 0)) return 0;
  const Vector2f at = p.head<2>() + distance * direction.head<2>();
  if (!opening.extent.contains(at)) return 0;
  return distance * distance / (opening.extent.volume() * direction.z());
}

/// What a diffuse direction that leaves the world brings.
Vector3f PathRenderer::sky_found(const Vector3f& p, const Vector3f& direction, float facing) const {
  const Vector3f sky = environment_.sky(direction);
  if (search_ == SkySearch::kByChance) return sky;
  const float density =
      search_ == SkySearch::kOpening ? opening_density(p, direction) : sampler_.density(direction);
  return (facing / kPiFloat) / (density + facing / kPiFloat) * sky;
}

// A path goes on in a direction of diffuse reflection; where it leaves the world it has found the sky, and
// at every surface it looks for the sun. What would be reflected more often is left out. `from` lies on the
// surface that was hit; its own sunlight and albedo are the caller's.
Vector3f PathRenderer::incoming(Vector3f from, RayHit hit, int k, PixelSamples& samples) const {
  Vector3f light = Vector3f::Zero(), throughput = Vector3f::Ones();
  for (int bounce = 0;; ++bounce) {
    const bool first = bounce == 0;
    const Vector2f sky = first ? samples.sky[k] : samples.stream.pair();
    if (search_ == SkySearch::kOpening)
      light += throughput.cwiseProduct(light_from_above(from, hit.normal, sky));
    if (search_ == SkySearch::kBrightParts) light += throughput.cwiseProduct(skylight(from, hit.normal, sky));
    const Vector3f direction = diffuse_direction(hit.normal, search_ == SkySearch::kByChance ? sky
                                                             : first ? samples.around[k]
                                                                     : samples.stream.pair());
    const auto next = everything_.trace(from, direction);
    if (!next) return light + throughput.cwiseProduct(sky_found(from, direction, hit.normal.dot(direction)));
    if (bounce == options_.bounces) return light;
    hit = *next;
    const Vector3f p = from + hit.distance * direction;
    throughput = throughput.cwiseProduct(materials_[hit.material](p, hit.normal));
    from = above(p, hit.normal);
    light += throughput.cwiseProduct(sunlight(from, hit.normal, samples.stream.pair()));
  }
}

/// Sums over a pixel's samples.
struct PathRenderer::PixelLight {
  Vector3f sharp = Vector3f::Zero();     // the sun's light and the sky behind everything
  Vector3f albedo = Vector3f::Zero();    // of the surfaces that were hit
  Vector3f incoming = Vector3f::Zero();  // all other light on them, over pi
  int hits = 0, extra_hits = 0;
};

PathRenderer::PixelLight PathRenderer::light_of_pixel(const PinholeCamera& camera, int x, int y,
                                                      PixelSamples& samples) const {
  const int count = options_.samples;
  for (auto* pairs : {&samples.sun, &samples.sky, &samples.around}) samples.stream.even_pairs(count, *pairs);
  PixelLight sum;
  for (int k = 0; k < count; ++k) {
    const Vector2f at = even_point(k);
    const Ray ray = camera.ray(x + at.x(), y + at.y());
    const Vector3f origin = ray.origin.cast<float>(), direction = ray.direction.normalized().cast<float>();
    const auto hit = everything_.trace(origin, direction);
    if (!hit) {
      if (options_.environment_seen) sum.sharp += environment_.seen(direction);
      continue;
    }
    const Vector3f p = origin + hit->distance * direction, from = above(p, hit->normal);
    const Vector3f albedo = materials_[hit->material](p, hit->normal);
    sum.sharp += albedo.cwiseProduct(sunlight(from, hit->normal, samples.sun[k]));
    sum.albedo += albedo;
    sum.incoming += incoming(from, *hit, k, samples);
    ++sum.hits;
    sum.extra_hits += hit->extra;
  }
  return sum;
}

/// What lasts, for the truth; what is there at the moment is returned.
std::optional<RayHit> PathRenderer::measure_pixel(const PinholeCamera& camera, int x, int y,
                                                  Picture& picture) const {
  const Ray ray = camera.ray(x + 0.5, y + 0.5);
  const Vector3f origin = ray.origin.cast<float>(), direction = ray.direction.cast<float>();
  const auto hit = lasting_.trace(origin, direction);
  if (hit) {
    *picture.depth.pixel(x, y) = hit->distance;
    Eigen::Map<Vector3f>(picture.normal.pixel(x, y)) = hit->normal;
    Eigen::Map<Vector3f>(picture.albedo.pixel(x, y)) =
        materials_[hit->material](origin + hit->distance * direction, hit->normal);
  }
  return &lasting_ == &everything_ ? hit : everything_.trace(origin, direction);
}

Picture PathRenderer::render(const PinholeCamera& camera, int image, const RunContext& context) const {
  const int width = camera.intrinsics.width, height = camera.intrinsics.height;
  const Image grey(width, height, 1), color(width, height, 3);
  Picture picture{color, grey, color, color, Mask(width, height, 0), Mask(width, height, 0)};
  Image albedo = color, light = color;
  SurfaceGuide guide{grey, color};
  PixelSamples samples;
  for (int y = 0; y < height; ++y) {
    context.throw_if_cancelled();
    for (int x = 0; x < width; ++x) {
      samples.stream = SampleStream(x, y, image, options_.seed);
      const PixelLight sum = light_of_pixel(camera, x, y, samples);
      const auto count = static_cast<float>(options_.samples);
      Eigen::Map<Vector3f>(picture.rgb.pixel(x, y)) = sum.sharp / count;
      Eigen::Map<Vector3f>(albedo.pixel(x, y)) = sum.albedo / count;
      Eigen::Map<Vector3f>(light.pixel(x, y)) = sum.incoming / std::max(1.0f, static_cast<float>(sum.hits));
      picture.mask.at(x, y) = share(sum.hits, options_.samples);
      picture.transient.at(x, y) = share(sum.extra_hits, options_.samples);
      if (const auto hit = measure_pixel(camera, x, y, picture)) {
        *guide.depth.pixel(x, y) = hit->distance;
        Eigen::Map<Vector3f>(guide.normal.pixel(x, y)) = hit->normal;
      }
    }
  }
  light = smoothed_light(std::move(light), guide, camera, options_.smoothing);
  for (std::size_t i = 0; i < light.data().size(); ++i)
    picture.rgb.data()[i] += albedo.data()[i] * light.data()[i];
  return picture;
}

}  // namespace roxel

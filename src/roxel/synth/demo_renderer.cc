#include "roxel/synth/demo_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using Eigen::Vector3f;

constexpr float kSurface = 1.2e-4f;   // a ray this close has arrived
constexpr float kNormalStep = 6e-4f;  // smooths detail that is far below a pixel
constexpr float kFarAway = 100.0f;

const Vector3f kToSun = Vector3f(-0.55f, -0.62f, 0.62f).normalized();
const Vector3f kSunColor(1.00f, 0.90f, 0.74f);
const Vector3f kSkyColor(0.34f, 0.38f, 0.46f);
const Vector3f kBounceColor(0.52f, 0.45f, 0.36f);

/// Where a line is inside the scene's box; empty when begin > end.
struct Interval {
  float begin, end;
};

Interval inside_bounds(const Vector3f& origin, const Vector3f& direction, float limit) {
  const Eigen::AlignedBox3f box = DemoScene::bounds();
  Interval inside{0, limit};
  for (int i = 0; i < 3; ++i) {
    const float inverse = 1 / direction[i];
    const float a = (box.min()[i] - origin[i]) * inverse, b = (box.max()[i] - origin[i]) * inverse;
    inside.begin = std::max(inside.begin, std::min(a, b));
    inside.end = std::min(inside.end, std::max(a, b));
  }
  return inside;
}

}  // namespace

DemoRenderer::DemoRenderer(const DemoScene& scene, DemoBackground background, int samples_per_axis)
    : scene_(scene), background_(background), samples_per_axis_(samples_per_axis) {
  ROXEL_CHECK_GE(samples_per_axis, 1);
}

std::optional<float> DemoRenderer::trace(const Vector3f& origin, const Vector3f& direction, float begin,
                                         float limit) const {
  const Interval inside = inside_bounds(origin, direction, limit);
  constexpr int kMaxSteps = 400;
  float t = std::max(begin, inside.begin);
  for (int step = 0; step < kMaxSteps && t < inside.end; ++step) {
    const float distance = scene_.distance(origin + t * direction);
    if (distance < kSurface) return t;
    t += distance;
  }
  return std::nullopt;
}

// One march serves shadow and its soft edge: the narrowest clearance, as an angle, decides how much of the
// sun's (enlarged) disc is covered.
float DemoRenderer::sunlight(const Vector3f& p) const {
  constexpr float kSharpness = 22;
  const Interval inside = inside_bounds(p, kToSun, kFarAway);
  float light = 1, t = 4e-3f;
  for (int step = 0; step < 80 && t < inside.end; ++step) {
    const float distance = scene_.distance(p + t * kToSun);
    light = std::min(light, kSharpness * distance / t);
    if (light < 0.004f) return 0;
    t += std::clamp(distance, 4e-3f, 0.25f);
  }
  return light * light * (3 - 2 * light);
}

// Ambient occlusion: how much closer the nearest surface is than an open half space would have it.
float DemoRenderer::openness(const Vector3f& p, const Vector3f& normal) const {
  float closed = 0, weight = 1;
  for (int i = 1; i <= 4; ++i) {
    const float height = 0.035f * static_cast<float>(i * i) * 0.5f;
    closed += weight * std::max(0.0f, height - scene_.distance(p + height * normal)) / height;
    weight *= 0.8f;
  }
  return std::clamp(1 - 0.36f * closed, 0.08f, 1.0f);
}

Vector3f DemoRenderer::shade(const Vector3f& p) const {
  const Vector3f normal = scene_.normal(p, kNormalStep);
  const Vector3f albedo = scene_.albedo(p, normal);
  const Vector3f above = p + 2e-3f * normal;
  const float facing = normal.dot(kToSun);
  const float sun = facing > 0 ? facing * sunlight(above) : 0.0f;
  const float open = openness(above, normal);
  const float up = 0.5f + 0.5f * normal.z();
  const Vector3f light = sun * kSunColor + open * (up * kSkyColor + (1 - up) * kBounceColor);
  return albedo.cwiseProduct(light);
}

bool DemoRenderer::visible(const Vector3f& p, const Vector3f& centre) const {
  const Vector3f to_camera = (centre - p).normalized();
  const Vector3f normal = scene_.normal(p, kNormalStep);
  if (normal.dot(to_camera) < 0.05f) return false;
  return !trace(p + 3e-3f * normal, to_camera, 0, (centre - p).norm());
}

Vector3f DemoRenderer::sky(const Vector3f& direction) const {
  if (background_ == DemoBackground::kBlack) return Vector3f::Zero();
  const Vector3f zenith(0.10f, 0.24f, 0.58f), horizon(0.62f, 0.72f, 0.82f), haze(0.50f, 0.53f, 0.55f);
  const float up = direction.z();
  if (up < 0) return horizon + std::min(1.0f, -3 * up) * (haze - horizon);
  return horizon + (1 - std::pow(1 - up, 4.0f)) * (zenith - horizon);
}

/// A square block of pixels, cut at the image's border.
struct DemoRenderer::Tile {
  static constexpr int kSide = 8;
  int x0, y0, x1, y1;
};

// All rays of a tile lie in a cone about its middle ray. A ball of the distance to the nearest surface that
// is wider than the cone there is empty, so the cone advances until it no longer fits; every ray of the tile
// may start there.
float DemoRenderer::clear_distance(const PinholeCamera& camera, const Tile& tile) const {
  const Ray middle = camera.ray(0.5 * (tile.x0 + tile.x1), 0.5 * (tile.y0 + tile.y1));
  const Vector3f origin = middle.origin.cast<float>(),
                 direction = middle.direction.normalized().cast<float>();
  float slope = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const Ray ray = camera.ray(corner & 1 ? tile.x1 : tile.x0, corner & 2 ? tile.y1 : tile.y0);
    slope = std::max(slope, (ray.direction.normalized().cast<float>() - direction).norm());
  }
  const float end = inside_bounds(origin, direction, kFarAway).end;
  float t = 0;
  for (int step = 0; step < 200 && t < std::max(end, kFarAway); ++step) {
    const float room = scene_.distance(origin + t * direction) - slope * t;
    if (room < 1e-3f) break;
    t += room / (1 + slope);
  }
  return t;
}

void DemoRenderer::render_tile(const PinholeCamera& camera, const Tile& tile, DemoPicture& picture) const {
  const int n = samples_per_axis_;
  const float begin = clear_distance(camera, tile);
  for (int y = tile.y0; y < tile.y1; ++y)
    for (int x = tile.x0; x < tile.x1; ++x) {
      Vector3f sum = Vector3f::Zero();
      int hits = 0;
      for (int s = 0; s < n * n; ++s) {
        const Ray ray = camera.ray(x + (s % n + 0.5) / n, y + (s / n + 0.5) / n);
        const Vector3f origin = ray.origin.cast<float>(),
                       direction = ray.direction.normalized().cast<float>();
        const auto t = trace(origin, direction, begin, kFarAway);
        sum += t ? shade(origin + *t * direction) : sky(direction);
        hits += t.has_value();
      }
      const Ray centre = camera.ray(x + 0.5, y + 0.5);
      const double length = centre.direction.norm();
      const auto t =
          trace(centre.origin.cast<float>(), (centre.direction / length).cast<float>(), begin, kFarAway);
      *picture.depth.pixel(x, y) = t ? static_cast<float>(*t / length) : 0.0f;
      for (int c = 0; c < 3; ++c) picture.rgb.pixel(x, y)[c] = sum[c] / static_cast<float>(n * n);
      picture.mask.at(x, y) = static_cast<std::uint8_t>(std::lround(255.0 * hits / (n * n)));
    }
}

DemoPicture DemoRenderer::render(const PinholeCamera& camera, const RunContext& context) const {
  const int width = camera.intrinsics.width, height = camera.intrinsics.height;
  DemoPicture picture{Image(width, height, 3), Image(width, height, 1), Mask(width, height, 0)};
  for (int y = 0; y < height; y += Tile::kSide) {
    context.throw_if_cancelled();
    for (int x = 0; x < width; x += Tile::kSide)
      render_tile(camera, {x, y, std::min(x + Tile::kSide, width), std::min(y + Tile::kSide, height)},
                  picture);
  }
  return picture;
}

}  // namespace roxel

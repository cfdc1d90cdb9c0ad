/// A head with a patterned cap and scarf on a turntable: plain skin between textured parts
/// ([Jethwa04] 8.1.2). World units of about a decimetre; the face looks along -Y.

#include <cmath>
#include <numbers>

#include "roxel/base/angles.h"
#include "roxel/synth/camera_paths.h"
#include "roxel/synth/mesh_builder.h"
#include "roxel/synth/world.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

enum Part { kSkin, kHair, kCap, kScarf, kEye, kIris, kLips };

/// A smooth hill about the unit direction `middle`, `wide` across and `high` up.
struct Hill {
  Vector3f middle;
  float wide, high, height;
};

float hill_at(const Hill& hill, const Vector3f& d) {
  const Vector3f middle = hill.middle.normalized();
  if (d.dot(middle) < 0) return 0;
  const Vector3f across = Vector3f::UnitZ().cross(middle).normalized(), up = middle.cross(across);
  const float s = d.dot(across) / hill.wide, t = d.dot(up) / hill.high;
  return hill.height * std::exp(-s * s - t * t);
}

/// Distance of the face from the head's middle in a direction.
float face_radius(const Vector3f& d) {
  static const Hill kHills[] = {
      {{0, -1, -0.10f}, 0.09f, 0.20f, 0.17f},      // bridge of the nose
      {{0, -1, -0.22f}, 0.10f, 0.09f, 0.15f},      // its tip
      {{0.10f, -1, -0.24f}, 0.06f, 0.06f, 0.06f},  // its wings
      {{-0.10f, -1, -0.24f}, 0.06f, 0.06f, 0.06f},
      {{0.33f, -1, 0.06f}, 0.15f, 0.11f, -0.11f},  // sockets of the eyes
      {{-0.33f, -1, 0.06f}, 0.15f, 0.11f, -0.11f},
      {{0.33f, -1, 0.27f}, 0.22f, 0.07f, 0.06f},  // brows
      {{-0.33f, -1, 0.27f}, 0.22f, 0.07f, 0.06f},
      {{0.55f, -0.85f, -0.22f}, 0.18f, 0.18f, 0.06f},  // cheeks
      {{-0.55f, -0.85f, -0.22f}, 0.18f, 0.18f, 0.06f},
      {{0, -1, -0.50f}, 0.20f, 0.05f, 0.06f},  // lips
      {{0, -1, -0.59f}, 0.17f, 0.05f, 0.06f},
      {{0, -1, -0.545f}, 0.20f, 0.018f, -0.03f},
      {{0, -0.85f, -0.85f}, 0.20f, 0.16f, 0.13f},  // chin
  };
  const Vector3f scaled(d.x() / 0.74f, d.y() / 0.88f, d.z() / (d.z() > 0 ? 1.0f : 1.05f));
  float radius = 1 / scaled.norm();
  const float jaw = std::max(0.0f, -d.z() - 0.15f);
  radius *= 1 - 0.5f * jaw * jaw * d.x() * d.x();
  for (const Hill& hill : kHills) radius += hill_at(hill, d);
  return radius;
}

Vector3f unit_direction(float u, float v) {
  const float polar = 0.5f * (2 * kPiFloat) * v, turn = (2 * kPiFloat) * u;
  return {std::sin(polar) * std::sin(turn), -std::sin(polar) * std::cos(turn), std::cos(polar)};
}

/// A cap's height over the head: none below its rim.
float cap_height(const Vector3f& d) {
  const float above_rim = d.z() - 0.52f - 0.10f * d.y();
  return above_rim > 0 ? 0.05f + 0.08f * std::min(1.0f, 3 * above_rim) : 0.0f;
}

std::vector<Texture> paints(std::uint32_t seed) {
  const Texture cap =
      tiles({{0xb23a2a, 0x1f5f8b, 0xe0b040, 0xf4efe6, 0x2f7d5b}, 0x33312f, 0.16f, 0.16f, 0.014f, 0.5f}, seed);
  return {uniform_paint(0xd9a98a),
          foliage(0x2a1a12, 0x8a5a34, 0.07f, seed + 1),
          cap,
          collage(0x2d4a7c, {0xe9dfc9, 0xd9a441, 0xb5452f, 0x9fc0d0}, 0.2f, seed + 2),
          uniform_paint(0xece8e0),
          grained(uniform_paint(0x2f5f6b), 0.03f, 0.6f, seed + 3),
          uniform_paint(0xb25a52)};
}

int part_at(const Vector3f& d) {
  if (cap_height(d) > 0) return kCap;
  const bool hair = d.y() > 0.12f - 0.3f * d.z() && d.z() > -0.55f;
  if (hair) return kHair;
  const Vector3f f = d / -std::min(d.y(), -1e-3f);  // on the plane before the face
  const bool lips =
      d.y() < -0.5f && std::abs(f.x()) < 0.21f && std::abs(f.z() + 0.545f) < 0.085f * (1 - 4 * f.x() * f.x());
  return lips ? kLips : kSkin;
}

void add_head(MeshBuilder& build) {
  constexpr int kAround = 320, kDown = 220;
  const auto point = [](float u, float v) {
    const Vector3f d = unit_direction(u, v);
    const float hair = part_at(d) == kHair ? 0.035f : 0.0f;
    return Vector3f((face_radius(d) + cap_height(d) + hair) * d);
  };
  // Cells take their paint from their middle.
  for (int j = 0; j < kDown; ++j)
    for (int i = 0; i < kAround; ++i) {
      const float u0 = static_cast<float>(i) / kAround, u1 = static_cast<float>(i + 1) / kAround;
      const float v0 = static_cast<float>(j) / kDown, v1 = static_cast<float>(j + 1) / kDown;
      build.use(part_at(unit_direction(0.5f * (u0 + u1), 0.5f * (v0 + v1))));
      build.triangle(point(u0, v0), point(u0, v1), point(u1, v1));
      build.triangle(point(u0, v0), point(u1, v1), point(u1, v0));
    }
}

void add_eyes_and_ears(MeshBuilder& build) {
  for (const float side : {-1.0f, 1.0f}) {
    const Vector3f eye(0.255f * side, -0.735f, 0.06f);
    build.use(kEye);
    build.ellipsoid(eye, Vector3f::Constant(0.115f), 48);
    build.use(kIris);
    build.ellipsoid(eye + Vector3f(0, -0.075f, 0), Vector3f(0.052f, 0.05f, 0.052f), 32);
    build.use(kSkin);
    build.place(placed({0.77f * side, 0.02f, 0.02f}, 0.35f * side));
    build.ellipsoid(Vector3f::Zero(), {0.06f, 0.13f, 0.21f}, 48);
    build.place(Eigen::Affine3f::Identity());
  }
}

void add_neck(MeshBuilder& build) {
  build.use(kSkin);
  build.cylinder({0, 0.12f, -1.5f}, {0, 0.1f, -0.6f}, 0.38f, 64);
  build.use(kScarf);
  const Vector2f knots[] = {{0, -1.78f},    {0.62f, -1.78f}, {0.74f, -1.7f},  {0.66f, -1.5f},
                            {0.5f, -1.36f}, {0.52f, -1.22f}, {0.44f, -1.13f}, {0.3f, -1.15f}};
  build.place(placed({0, 0.12f, 0}));
  build.lathe(smooth_profile(knots, 6), 96);
  build.place(Eigen::Affine3f::Identity());
}

}  // namespace

World head_world(const WorldRequest& request) {
  World world;
  world.bounds = {Vector3d(-1, -1.2, -1.9), Vector3d(1, 1.15, 1.25)};
  world.environment_seen = false;
  world.stages = {{Vector3f(-1.5f, -1.5f, -1.8f), Vector3f(-1.2f, 1.5f, -1.5f)},
                  {Vector3f(1.2f, -1.5f, -1.8f), Vector3f(1.5f, 1.5f, -1.5f)}};
  world.transient_size = 0.7f;
  world.materials = paints(request.seed);
  MeshBuilder build(world.mesh);
  add_head(build);
  add_eyes_and_ears(build);
  add_neck(build);
  const Vector3d target(0, 0, -0.3);
  const Intrinsics intrinsics = simple_intrinsics(request.width, request.height, 1.75);
  for (int i = 0; i < request.images; ++i) {
    const Vector3d centre = around(target, 6.2, 360.0 * i / request.images - 90, 8);
    world.shots.push_back({shot_name(i), {intrinsics, looking_at(centre, target)}});
  }
  give_each_shot_its_occasion(world);
  return world;
}

}  // namespace roxel

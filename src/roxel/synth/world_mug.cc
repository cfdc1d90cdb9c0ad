/// A glazed mug on a turntable, seen from above its rim: hollow, and with a hole in its handle
/// ([Jethwa04] 8.2.1 has a real one). World units of about a decimetre.

#include <cmath>
#include <numbers>

#include "roxel/synth/camera_paths.h"
#include "roxel/synth/mesh_builder.h"
#include "roxel/synth/world.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float kRadius = 0.4f, kInside = 0.36f, kHeight = 0.8f;

enum Glaze { kOutside, kHandle, kHollow };

std::vector<Texture> glazes(std::uint32_t seed) {
  const Texture bands = banded({0xd9702e, 0x1f5f8b, 0xe9dfc9, 0x2f7d5b, 0xd9a441, 0x8a2c4e}, 0.11f, seed);
  const Texture marks =
      collage(0xe9dfc9, {0xb23a2a, 0x1f5f8b, 0xe0b040, 0x2f7d5b, 0x33312f}, 0.24f, seed + 20);
  // A printed belt between painted bands; its plane is the one that the mug's side faces.
  const Texture outside = [bands, marks](const Vector3f& p, const Vector3f& n) {
    if (p.z() < 0.22f || p.z() > 0.6f) return bands(p, n);
    const float around = kRadius * std::atan2(p.y(), p.x());
    return marks(Vector3f(around, 0, p.z()), Vector3f::UnitY());
  };
  const Texture inside = banded({0xf0e6d0, 0x8fb4c0, 0xd9b070, 0xe0c8c0, 0x9fc0a0}, 0.06f, seed + 50);
  return {outside, grained(uniform_paint(0xd9a441), 0.05f, 0.5f, seed + 40),
          grained(inside, 0.05f, 0.7f, seed + 51)};
}

void add_body(MeshBuilder& build) {
  const Vector2f outside[] = {{0, 0},           {0.30f, 0},      {0.36f, 0.01f},
                              {kRadius, 0.06f}, {kRadius, 0.4f}, {kRadius, kHeight - 0.015f}};
  const Vector2f lip[] = {{kRadius, kHeight - 0.015f},
                          {0.393f, kHeight - 0.004f},
                          {0.38f, kHeight},
                          {0.367f, kHeight - 0.004f},
                          {kInside, kHeight - 0.015f}};
  const Vector2f inside[] = {
      {kInside, kHeight - 0.015f}, {kInside, 0.12f}, {0.33f, 0.06f}, {0.26f, 0.04f}, {0, 0.04f}};
  build.use(kOutside);
  build.lathe(outside, 128);
  build.use(kHollow);
  build.lathe(lip, 128);
  build.lathe(inside, 128);
}

void add_handle(MeshBuilder& build) {
  std::vector<Vector3f> path;
  for (int i = 0; i <= 32; ++i) {
    const float turn = std::numbers::pi_v<float> * (0.5f - static_cast<float>(i) / 32);
    path.emplace_back(0.382f + 0.33f * std::cos(turn), 0, 0.41f + 0.24f * std::sin(turn));
  }
  build.use(kHandle);
  build.tube(path, 0.05f, 24);
}

}  // namespace

World mug_world(const WorldRequest& request) {
  World world;
  world.bounds = {Vector3d(-0.5, -0.5, -0.08), Vector3d(0.86, 0.5, 0.88)};
  world.environment_seen = false;
  world.stages = {{Vector3f(-0.9f, -0.9f, -0.2f), Vector3f(-0.6f, -0.6f, -0.1f)},
                  {Vector3f(-0.9f, 0.6f, -0.2f), Vector3f(-0.6f, 0.9f, -0.1f)}};
  world.transient_size = 0.3f;
  world.materials = glazes(request.seed);
  MeshBuilder build(world.mesh);
  add_body(build);
  add_handle(build);
  const Vector3d target(0.1, 0, 0.36);
  const Intrinsics intrinsics = simple_intrinsics(request.width, request.height, 2.3);
  for (int i = 0; i < request.images; ++i) {
    const Vector3d centre = around(target, 3.2, 360.0 * i / request.images + 10, 36);
    world.shots.push_back({shot_name(i), {intrinsics, looking_at(centre, target)}});
  }
  give_each_shot_its_occasion(world);
  return world;
}

}  // namespace roxel

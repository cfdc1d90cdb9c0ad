/// A printed board before nothing, photographed from an arc in front of it ([Jethwa04] 8.1.1).

#include "roxel/synth/camera_paths.h"
#include "roxel/synth/mesh_builder.h"
#include "roxel/synth/world.h"

namespace roxel {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

void add_plane_shots(World& world, const WorldRequest& request) {
  constexpr int kRows = 3;
  const int columns = (request.images + kRows - 1) / kRows;
  const Intrinsics intrinsics = simple_intrinsics(request.width, request.height, 1.9);
  for (int i = 0; i < request.images; ++i) {
    const double across = columns > 1 ? static_cast<double>(i % columns) / (columns - 1) - 0.5 : 0;
    const double azimuth = -90 + 84 * across, elevation = 26 * (i / columns - 1) + 5 * across;
    const Vector3d centre = around(Vector3d::Zero(), 4.6, azimuth, elevation);
    world.shots.push_back({shot_name(i), {intrinsics, looking_at(centre, Vector3d::Zero())}});
  }
}

}  // namespace

World plane_world(const WorldRequest& request) {
  World world;
  world.bounds = {Vector3d(-1.1, -0.4, -1.1), Vector3d(1.1, 0.4, 1.1)};
  world.environment_seen = false;
  world.stages = {{Vector3f(-0.6f, -0.9f, -0.7f), Vector3f(0.6f, -0.6f, 0.4f)}};
  world.transient_size = 0.35f;
  world.materials = {collage(0xd8cdb4, {0xb23a2a, 0x1f5f8b, 0xe0b040, 0x2f7d5b, 0x33312f, 0xf4efe6, 0x7a4a7c},
                             0.42f, request.seed)};
  MeshBuilder build(world.mesh);
  build.box({-1, -0.03f, -1}, {1, 0.03f, 1});
  add_plane_shots(world, request);
  give_each_shot_its_occasion(world);
  return world;
}

}  // namespace roxel

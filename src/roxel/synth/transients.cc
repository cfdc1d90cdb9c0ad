#include "roxel/synth/transients.h"

#include "roxel/base/error.h"
#include "roxel/synth/mesh_builder.h"
#include "roxel/synth/noise.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// A standing figure of height 1.
void add_figure(MeshBuilder& build) {
  const Vector2f knots[] = {{0, 0},         {0.14f, 0},     {0.10f, 0.3f},  {0.15f, 0.55f},
                            {0.17f, 0.78f}, {0.06f, 0.84f}, {0.09f, 0.93f}, {0, 1}};
  build.lathe(smooth_profile(knots, 4), 20);
}

void add_parcel(MeshBuilder& build) { build.box({-0.35f, -0.25f, 0}, {0.35f, 0.25f, 0.6f}); }

void add_balloon(MeshBuilder& build) {
  build.ellipsoid({0, 0, 0.7f}, {0.28f, 0.28f, 0.3f}, 24);
  build.cylinder({0, 0, 0}, {0, 0, 0.41f}, 0.02f, 8);
}

}  // namespace

TriangleMesh make_transients(World& world, int occasion, int count, std::uint32_t seed) {
  ROXEL_CHECK(!world.stages.empty());
  TriangleMesh mesh;
  MeshBuilder build(mesh);
  for (int i = 0; i < count; ++i) {
    const auto random = [&](int what) { return lattice_random(occasion, i, what, seed ^ 0x7a55u); };
    const auto pick = static_cast<std::size_t>(random(0) * static_cast<float>(world.stages.size()));
    const Eigen::AlignedBox3f& stage = world.stages[pick];
    const Vector3f at = stage.min() + stage.sizes().cwiseProduct(Vector3f(random(1), random(2), random(3)));
    const float size = world.transient_size * (0.8f + 0.4f * random(4));
    const Eigen::Affine3f place = placed(at, 6.2832f * random(5)) * Eigen::Scaling(size);
    const std::uint32_t code = lattice_hash(occasion, i, 6, seed) & 0xffffff;
    world.materials.push_back(grained(uniform_paint(code), 0.12f * world.transient_size, 0.5f, seed + 7));
    build.use(static_cast<int>(world.materials.size()) - 1);
    build.place(place);
    const float kind = random(7);
    kind < 0.4f ? add_figure(build) : kind < 0.7f ? add_parcel(build) : add_balloon(build);
  }
  return mesh;
}

}  // namespace roxel

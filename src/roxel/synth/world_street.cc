/// The street block from nodes on its pavement, twenty photographs from each, each node at its own date and
/// time: what [Jethwa04] chapter 8 has of real streets.

#include <cstdio>

#include "roxel/synth/camera_paths.h"
#include "roxel/synth/street_block.h"

namespace roxel {
namespace {

using Eigen::Vector3d;

constexpr int kShotsOfNode = 20;

/// Nodes are about ten metres apart: eight along the square, six more on its other side.
Vector3d node_centre(int node) {
  const bool back = node >= 8;
  const double x = back ? 30 - 10.5 * (node - 8) : -35 + 10 * node;
  const double y = back ? 3.2 * (node % 2 ? 1 : -1) : 2.6 * (node % 2 ? -1 : 1);
  const double z = 1.7 + 0.5 * (node % 3) + (node % 4 == 3 ? 2.5 : 0.0);
  return (street_frame().cast<double>()) * Vector3d(x, y, z);
}

/// June to September, morning to evening; days and hours apart.
UtcSeconds node_time(int node) {
  constexpr UtcSeconds kFirst = 1686787200;  // 2023-06-15T00:00:00Z
  constexpr double kHours[] = {8.5, 11.25, 15.5, 6.75, 13.0, 16.5, 10.0};
  return kFirst + 86400.0 * (6 * node + (node % 2)) + 3600 * kHours[node % 7];
}

}  // namespace

World street_world(const WorldRequest& request) {
  World world;
  build_street_block(world, request.seed);
  world.occasions_are_nodes = true;
  world.high_dynamic_range = true;
  // 54 x 44 degrees at 324 x 256.
  const Intrinsics intrinsics = simple_intrinsics(request.width, request.height, 318.0 / 256);
  const std::vector<Vector3d> directions = hemisphere_directions();
  for (int i = 0; i < request.images; ++i) {
    const int node = i / kShotsOfNode, k = i % kShotsOfNode;
    if (k == 0) world.times_utc_s.push_back(node_time(node));
    char name[32];
    std::snprintf(name, sizeof name, "n%02d_%02d", node, k);
    const Vector3d centre = node_centre(node);
    world.shots.push_back({name, {intrinsics, looking_at(centre, centre + directions[k])}, node});
  }
  return world;
}

}  // namespace roxel

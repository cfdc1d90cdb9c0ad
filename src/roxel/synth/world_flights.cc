/// The street block as a drone sees it: three flights at different dates, hours and weathers, each with views
/// straight down and from the side.

#include <cstdio>

#include "roxel/synth/camera_paths.h"
#include "roxel/synth/street_block.h"

namespace roxel {
namespace {

using Eigen::Vector3d;

constexpr int kFlights = 3;

/// Two fifths of a flight's views look straight down from lines over the block, the others at its middle
/// from a ring around it.
Pose flight_pose(int flight, int k, int count) {
  const Eigen::Affine3d frame = street_frame().cast<double>();
  const int down = 2 * count / 5;
  if (k < down) {
    const int columns = (down + 1) / 2;
    const double x = columns > 1 ? -36 + 72.0 * (k / 2) / (columns - 1) : 0;
    const Vector3d below = frame * Vector3d(x + 4 * flight, k % 2 ? 9 : -9, 0);
    return looking_at(below + Vector3d(0, 0, 58 + 3 * flight), below);
  }
  const int side = k - down;
  const double azimuth = 360.0 * side / (count - down) + 11 * flight;
  const Vector3d target = frame * Vector3d(side % 3 * 16 - 16, 0, 4);
  return looking_at(around(target, 62, azimuth, 34 + 8 * flight), target);
}

}  // namespace

World flights_world(const WorldRequest& request) {
  World world;
  build_street_block(world, request.seed);
  world.times_utc_s = {1687332600,   // 2023-06-21T07:30:00Z
                       1690543800,   // 2023-07-28T11:30:00Z
                       1693929600};  // 2023-09-05T16:00:00Z
  const Intrinsics intrinsics = simple_intrinsics(request.width, request.height, 1.25);
  for (int i = 0; i < request.images; ++i) {
    const int flight = i * kFlights / request.images;
    const int first = (flight * request.images + kFlights - 1) / kFlights;
    const int next = ((flight + 1) * request.images + kFlights - 1) / kFlights;
    char name[32];
    std::snprintf(name, sizeof name, "f%d_%02d", flight, i - first);
    world.shots.push_back({name, {intrinsics, flight_pose(flight, i - first, next - first)}, flight});
  }
  return world;
}

}  // namespace roxel

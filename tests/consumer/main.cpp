// Uses an installed roxel: a camera, a volume, the reader of data sets, and an error.
#include <cstdio>

#include "roxel/base/error.h"
#include "roxel/camera/camera.h"
#include "roxel/io/dataset_reader.h"
#include "roxel/volume/volume.h"

int main() {
  // A point on the optical axis, two units ahead, is seen at the principal point.
  roxel::PinholeCamera camera;
  camera.intrinsics = {.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240};
  const Eigen::Vector3d seen = camera.project({0, 0, 2});
  if (!seen.isApprox(Eigen::Vector3d(320, 240, 2))) return std::puts("wrong projection"), 1;

  // One voxel, which dilation makes a cube of 27.
  roxel::LatticeFrame frame;
  frame.size_in_bricks = {1, 1, 1};
  roxel::Topology topology(frame);
  topology.insert({4, 4, 4});
  topology.dilate(1);
  const roxel::Volume volume({topology});
  if (volume.slot_count() != 27) return std::puts("wrong number of voxels"), 1;

  try {
    roxel::read_dataset("no such folder");
  } catch (const roxel::InvalidInput& error) {
    std::printf("roxel works: %s\n", error.what());
    return 0;
  }
  return std::puts("a data set that is not there was read"), 1;
}

#pragma once
/// Synthetic volumes and photographs for benchmarks of passes: no data set, the same bits each time.

#include <cstdint>
#include <vector>

#include "roxel/infer/run_pass.h"

namespace roxel {

/// How much of its bricks a volume fills.
enum class Occupancy {
  kFull,   ///< a block: every voxel of every brick
  kHalf,   ///< each voxel or not, by chance
  kShell,  ///< sheets 4 voxels thick, which a ray crosses two or three times: as in volumes of photographs
  kSheet,  ///< the same 1.5 voxels thick: hardly a step in a brick
};
const char* name_of(Occupancy occupancy);

/// Half a million to a million voxels of size 1 from the origin on.
Volume make_volume(Occupancy occupancy);

/// The bricks of a gyroid `thickness` voxels thick that goes `periods` times through a box of
/// `side_in_bricks`.
std::vector<BrickVoxels> gyroid_bricks(int side_in_bricks, double periods, double thickness, int threads);

struct ViewOptions {
  int count = 1;               ///< nodes of one view each, all around the volume
  double spacing = 1;          ///< of neighbouring rays at the volume's centre, in voxels
  int most_samples = 1 << 12;  ///< along a side of the image
};

/// Nodes whose views show the whole volume. Samples are squares of 2 x 2 pixels, so that they have a
/// covariance; none divides.
std::vector<SampleNode> make_nodes(const Volume& volume, const ViewOptions& options);

}  // namespace roxel

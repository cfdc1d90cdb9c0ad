#pragma once
/// What a reconstruction will need before it is started: for `roxel info` and dry runs. Voxels and steps
/// follow from cameras, box and voxel size, with factors measured on real scenes; good to about a factor
/// of 2.

#include "roxel/solve/scene.h"

namespace roxel {

struct LevelEstimate {
  double voxel_size = 0;
  double voxels = 0;          ///< in the box and around it
  double steps_per_pass = 0;  ///< ray-voxel steps of an opacity march
};

struct CostEstimate {
  std::vector<LevelEstimate> levels;
  double memory_bytes = 0;  ///< largest resident memory
  double seconds = 0;       ///< wall time on `threads` cores
};

/// `scene` is from lay_out() or survey(); `surround_count` decides whether its lattices are counted.
CostEstimate estimate_cost(const Dataset& dataset, const Scene& scene, const ReconstructOptions& options,
                           int threads);

}  // namespace roxel

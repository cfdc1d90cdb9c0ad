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
  MemoryPlan memory;
  double seconds = 0;  ///< wall time on `threads` cores, where all samples stay in memory
};

/// `scene` is from lay_out() or survey(); `surround_count` decides whether its lattices are counted.
CostEstimate estimate_cost(const Dataset& dataset, const Scene& scene, const ReconstructOptions& options,
                           int threads);

/// Shares out options.memory, or else what the machine has at hand: to what all levels need, then to threads
/// that march at once, to samples, and to kept colours.
MemoryPlan plan_memory(const Dataset& dataset, const Scene& scene, const ReconstructOptions& options,
                       int threads);

/// Throws InvalidInput where options.memory is given and does not do.
void require_memory(const Dataset& dataset, const Scene& scene, const ReconstructOptions& options,
                    int threads);

/// For people, where a plan does not fit: what there is, what is needed, and what would fit.
std::string memory_shortage(const Dataset& dataset, const Scene& scene, const ReconstructOptions& options,
                            int threads);

/// Bytes of a pyramid of an image of so many pixels.
double pyramid_bytes(double pixels, int finest_level);

}  // namespace roxel

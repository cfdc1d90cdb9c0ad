#pragma once
/// Voxels where the truth has nothing but sky: what a sky that was not told from surfaces leaves behind.

#include <cstdint>
#include <span>
#include <vector>

#include "roxel/camera/camera.h"
#include "roxel/surface/mesh.h"

namespace roxel {

/// How one voxel stands in the true scene.
struct SkyStand {
  bool in_the_open = false;  ///< a ray from its centre straight up meets no true surface
  bool above_all = false;    ///< it is higher than all of the true surface
  bool before_sky = false;   ///< some view shows nothing but sky there: its rays through centre and corners
                             ///< meet no true surface, before the voxel or behind
};

struct SkyDebrisOptions {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< unit
  double clearance = 0;   ///< world units: nearer to the true surface than this, or as near, none holds
  double voxel_size = 0;  ///< world units: where the corners are
};

/// Of each place. `surface` must have triangles. The same for any number of threads.
std::vector<SkyStand> sky_stands(const Mesh& surface, std::span<const Eigen::Vector3d> places,
                                 std::span<const PinholeCamera> cameras, const SkyDebrisOptions& options,
                                 int threads);

/// Number of voxels, and the sum of their opacities.
struct VoxelSum {
  std::int64_t voxels = 0;
  double opacity = 0;
};

/// Over voxels of at least one opacity.
struct SkyDebris {
  double opacity_threshold = 0;
  VoxelSum all, in_the_open, above_all, before_sky;

  double share(const VoxelSum& part) const;             ///< of the voxels, [0, 1]
  double share_of_opacity(const VoxelSum& part) const;  ///< of their summed opacity, [0, 1]
};

SkyDebris sky_debris(std::span<const float> opacity, std::span<const SkyStand> stands,
                     double opacity_threshold);

}  // namespace roxel

#pragma once
/// Colours between voxels' centres: trilinear interpolation over the voxels that exist.

#include <array>

#include "roxel/march/ray_walk.h"

namespace roxel {

/// The voxels around a point and what each of them counts there; weights sum to 1.
struct VoxelBlend {
  int count = 0;
  std::array<std::uint32_t, 8> slot;
  std::array<float, 8> weight;
};

/// `at` is in voxels of the index's frame (a voxel's centre at half-integers), inside a voxel that exists.
/// Where one of the eight voxels around it does not, the others count for it in proportion.
VoxelBlend blend_around(const BrickIndex& index, const Eigen::Vector3d& at);

/// A ray's point at a depth, in voxels of the frame.
inline Eigen::Vector3d in_voxels(const LatticeFrame& frame, const Ray& ray, double depth) {
  return (ray.origin + depth * ray.direction - frame.origin) / frame.voxel_size;
}

}  // namespace roxel

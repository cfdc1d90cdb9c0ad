// What a DistanceField holds, for the .cc files of this module alone: OpenVDB stays out of headers.
// Three trees of one topology; a voxel of theirs is a corner of the lattice, at origin + voxel_size * ijk.
#pragma once

#include <openvdb/openvdb.h>

#include "roxel/surface/depth_fusion.h"
#include "roxel/volume/vdb_grids.inl"

namespace roxel {

struct DistanceField::Voxels {
  Eigen::Vector3d origin;
  double voxel_size = 1;
  double band = 1;  ///< world units
  openvdb::FloatTree::Ptr distance, weight, views;

  Eigen::Vector3d position(const openvdb::Coord& ijk) const {
    return origin + voxel_size * Eigen::Vector3d(ijk.x(), ijk.y(), ijk.z());
  }
};

/// Bytes at the peak of what comes after the votes: smoothing or filling, and the lattice's triangles.
/// `corners`: active ones.
std::int64_t lattice_bytes(std::int64_t leaves, std::int64_t corners);

/// Throws InvalidInput where `bytes` are more than `most`.
void check_lattice_bytes(std::int64_t bytes, std::int64_t most, double voxel_size);

/// Pulls distances towards those of their neighbours, the more the less sure they are: screened smoothing, a
/// few rounds, all corners at once. The weight of a neighbour is `strength` per step squared.
void smooth_distance(DistanceField::Voxels& voxels, double strength, int threads);

/// Carries distances on to corners that nobody saw, around the places where seen surface ends, so far that
/// what comes from both sides of a hole meets: diffusion [Davis02]. Those get DistanceField::kFilled views.
/// Throws InvalidInput where that would take more than `most_bytes`.
void fill_unseen(DistanceField::Voxels& voxels, double hole_size, std::int64_t most_bytes, int threads);

}  // namespace roxel

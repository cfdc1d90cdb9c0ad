// What a DistanceField holds, for the .cc files of this module alone: OpenVDB stays out of headers.
// Three trees of one topology; a voxel of theirs is a corner of the lattice, at origin + voxel_size * ijk.
#pragma once

#include <openvdb/openvdb.h>

#include "roxel/surface/depth_fusion.h"

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

}  // namespace roxel

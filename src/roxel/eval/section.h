#pragma once
/// Cross-sections: a volume's opacities in a plane across one axis, and where a surface meets that plane.

#include <array>
#include <vector>

#include "roxel/image/image.h"
#include "roxel/surface/mesh.h"
#include "roxel/volume/volume.h"

namespace roxel {

/// A straight piece of an outline: its ends in the picture's coordinates, voxels from its left and top edges.
using OutlinePiece = std::array<Eigen::Vector2d, 2>;

/// The voxels that a plane lies in. Seen against the axis: for z, x to the right and y up; for y, x to the
/// right and z up; for x, y to the right and z up.
struct Section {
  int axis = 2;         ///< 0, 1, 2: x, y, z
  double position = 0;  ///< of the plane along the axis, world units
  double voxel_size = 1;
  Image opacity;  ///< 1 channel in [0, 1], a pixel a voxel; 0 where there is none
  std::vector<OutlinePiece> outline = {};
};

/// Through lattice 0. A position outside its box gives an empty picture.
Section opacity_section(const Volume& volume, int axis, double position);

/// Where the triangles meet the section's plane.
std::vector<OutlinePiece> surface_outline(const Mesh& mesh, const Section& section,
                                          const LatticeFrame& frame);

}  // namespace roxel

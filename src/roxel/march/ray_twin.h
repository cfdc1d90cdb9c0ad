#pragma once
/// For tests and benchmarks: the ray walk without cleverness. Every plane of every lattice is met with the
/// ray, the depths are sorted, and each stretch between two of them lies in one cell, found from its middle.
/// Doubles.

#include <algorithm>
#include <cmath>
#include <vector>

#include "roxel/march/ray_walk.h"

namespace roxel {

/// A cell's stretch of a ray, whether or not a voxel exists there.
struct TwinChord {
  int lattice;
  Eigen::Vector3i ijk;
  double in, out;  ///< depths
  double length;   ///< in voxel lengths of the lattice
  double weight;   ///< ray weight

  double depth() const { return 0.5 * (in + out); }
};

/// 1 - d / (sqrt(3)/2), not below 0; d = distance of the ray's line from the cell's centre, in voxel lengths.
inline double twin_ray_weight(const LatticeFrame& frame, const Ray& ray, const Eigen::Vector3i& ijk) {
  const Eigen::Vector3d to_centre = frame.voxel_centre(ijk) - ray.origin;
  const double distance = to_centre.cross(ray.direction.normalized()).norm() / frame.voxel_size;
  return std::max(0.0, 1 - distance / (std::sqrt(3.0) / 2));
}

/// The chords of all cells within `range` in ray order; a point belongs to the innermost lattice that holds
/// it.
inline std::vector<TwinChord> twin_chords(const std::vector<LatticeFrame>& frames, const Ray& ray,
                                          Stretch range) {
  std::vector<double> depths{range.begin, range.end};
  for (const LatticeFrame& frame : frames)
    for (int axis = 0; axis < 3; ++axis)
      for (int plane = 0; ray.direction[axis] != 0 && plane <= frame.size_in_voxels()[axis]; ++plane) {
        const double at = frame.origin[axis] + plane * frame.voxel_size;
        const double t = (at - ray.origin[axis]) / ray.direction[axis];
        if (t > range.begin && t < range.end) depths.push_back(t);
      }
  std::sort(depths.begin(), depths.end());

  std::vector<TwinChord> chords;
  for (std::size_t i = 1; i < depths.size(); ++i) {
    const double in = depths[i - 1], out = depths[i];
    if (out <= in) continue;
    const Eigen::Vector3d middle = ray.origin + 0.5 * (in + out) * ray.direction;
    for (int lattice = 0; lattice < static_cast<int>(frames.size()); ++lattice) {
      const LatticeFrame& frame = frames[lattice];
      const Eigen::Vector3d cell = ((middle - frame.origin) / frame.voxel_size).array().floor();
      const Eigen::Vector3d size = frame.size_in_voxels().cast<double>();
      if ((cell.array() < 0).any() || (cell.array() >= size.array()).any()) continue;
      const Eigen::Vector3i ijk = cell.cast<int>();
      const double length = (out - in) * ray.direction.norm() / frame.voxel_size;
      chords.push_back({lattice, ijk, in, out, length, twin_ray_weight(frame, ray, ijk)});
      break;
    }
  }
  return chords;
}

/// Neighbouring chords of one cell joined (planes of outer lattices cut them), and chords shorter than
/// `least` voxel lengths left out (rays through edges and corners).
inline std::vector<TwinChord> twin_joined(const std::vector<TwinChord>& chords, double least) {
  std::vector<TwinChord> joined;
  for (const TwinChord& chord : chords) {
    TwinChord* last = joined.empty() ? nullptr : &joined.back();
    if (last && last->lattice == chord.lattice && last->ijk == chord.ijk) {
      last->out = chord.out;
      last->length += chord.length;
    } else {
      joined.push_back(chord);
    }
  }
  std::erase_if(joined, [least](const TwinChord& chord) { return chord.length < least; });
  return joined;
}

}  // namespace roxel

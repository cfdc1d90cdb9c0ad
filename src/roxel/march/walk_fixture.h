#pragma once
/// For tests of walks: volumes and rays at random, and what walks must find in them.

#include <gtest/gtest.h>

#include <random>

#include "roxel/march/ray_twin.h"

namespace roxel {

inline constexpr double kSliver = 1e-6;  // voxel lengths; shorter chords may fall to either side of an edge
inline constexpr double kLengthTolerance = 2e-6;  // chords are floats of order 1
inline constexpr double kWeightTolerance = 2e-4;

inline std::vector<LatticeFrame> frames_of(const Volume& volume) {
  std::vector<LatticeFrame> frames;
  for (int k = 0; k < volume.lattice_count(); ++k) frames.push_back(volume.index(k).frame());
  return frames;
}

/// About `share` of all voxels, with one brick in four left out whole; all of them where share is 1.
inline Topology random_topology(const LatticeFrame& frame, double share, std::mt19937& random) {
  Topology topology(frame);
  std::bernoulli_distribution exists(share), brick_exists(share < 1 ? 0.75 : 1);
  const Eigen::Vector3i n = frame.size_in_bricks;
  for (int z = 0; z < n.z(); ++z)
    for (int y = 0; y < n.y(); ++y)
      for (int x = 0; x < n.x(); ++x) {
        BrickMask mask;
        for (int v = 0; v < kBrickVoxels; ++v) mask[v] = exists(random);
        if (brick_exists(random)) topology.insert_brick({x, y, z}, mask);
      }
  return topology;
}

inline Volume one_lattice(double share, const Eigen::Vector3i& bricks, std::mt19937& random) {
  const LatticeFrame frame{{-1, 2, 0.5}, 0.25, bricks};
  return Volume({random_topology(frame, share, random)});
}

inline Volume nested(double share, int surround, std::mt19937& random) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1));
  std::vector<Topology> lattices;
  for (const LatticeFrame& frame : nested_frames(box, 0.25, surround)) {
    lattices.push_back(random_topology(frame, share, random));
    if (lattices.size() > 1) lattices.back().erase_inside(lattices[lattices.size() - 2].frame().box());
  }
  return Volume(std::move(lattices));
}

inline std::vector<TwinChord> existing(const Volume& volume, const Ray& ray, Stretch range) {
  std::vector<TwinChord> chords = twin_joined(twin_chords(frames_of(volume), ray, range), kSliver);
  std::erase_if(chords, [&](const TwinChord& c) { return volume.index(c.lattice).slot(c.ijk) == kNoSlot; });
  return chords;
}

/// Whether a walk's steps are the twin's: the same voxels in the same order with the same chords. Steps whose
/// depth is not known have NaN there.
inline ::testing::AssertionResult same_as_twin(const Volume& volume, const Ray& ray, Stretch range,
                                               const std::vector<VoxelStep>& steps) {
  const std::vector<TwinChord> chords = existing(volume, ray, range);
  const auto failure = [&] {
    return ::testing::AssertionFailure()
           << "ray from " << ray.origin.transpose() << " along " << ray.direction.transpose() << " in ["
           << range.begin << ", " << range.end << "]: ";
  };
  if (steps.size() != chords.size())
    return failure() << steps.size() << " steps, " << chords.size() << " chords";
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const TwinChord& chord = chords[i];
    const bool same = steps[i].slot == volume.index(chord.lattice).slot(chord.ijk) &&
                      std::abs(steps[i].length - chord.length) <= kLengthTolerance &&
                      !(std::abs(steps[i].depth - chord.depth()) > 1e-6 * (1 + chord.depth())) &&
                      std::abs(steps[i].weight - chord.weight) <= kWeightTolerance;
    if (!same)
      return failure() << "step " << i << ": slot " << steps[i].slot << ", length " << steps[i].length
                       << ", weight " << steps[i].weight << ", depth " << steps[i].depth << "; expected slot "
                       << volume.index(chord.lattice).slot(chord.ijk) << ", length " << chord.length
                       << ", weight " << chord.weight << ", depth " << chord.depth();
  }
  return ::testing::AssertionSuccess();
}

/// A ray through voxel corners, edges and faces, its direction with zeros and equal components: every tie
/// that the choice of the next plane can meet. From inside the frame, or from outside on the same line.
inline Ray ray_with_ties(const LatticeFrame& frame, int steps_back, std::mt19937& random) {
  std::uniform_int_distribution<int> half_cell(1, 31), component(-2, 2);
  Ray ray{frame.origin, Eigen::Vector3d::Zero()};
  while (ray.direction.isZero()) {
    ray.origin = frame.origin;
    for (int a = 0; a < 3; ++a) {
      ray.origin[a] += 0.5 * frame.voxel_size * half_cell(random);
      ray.direction[a] = component(random);
    }
  }
  ray.origin -= ray.direction * steps_back;
  return ray;
}

class RandomRays {
 public:
  explicit RandomRays(const Eigen::AlignedBox3d& box, unsigned seed) : box_(box), random_(seed) {}

  /// From anywhere in a box three times as large to anywhere in the box.
  Ray any() {
    const Eigen::Vector3d from = box_.center() + 3 * (point() - box_.center());
    return {from, (point() - from) * scale_(random_)};
  }
  Eigen::Vector3d point() {
    Eigen::Vector3d x;
    for (int a = 0; a < 3; ++a) x[a] = box_.min()[a] + unit_(random_) * box_.sizes()[a];
    return x;
  }
  Stretch range() {
    const double begin = unit_(random_);
    return {begin, begin + 4 * unit_(random_)};
  }
  std::mt19937& engine() { return random_; }

 private:
  Eigen::AlignedBox3d box_;
  std::mt19937 random_;
  std::uniform_real_distribution<double> unit_{0, 1}, scale_{0.3, 2};
};

}  // namespace roxel

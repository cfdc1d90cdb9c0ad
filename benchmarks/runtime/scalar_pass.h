#pragma once
/// The image-centred pass written plainly: one ray after another, one voxel after another, floats, no vectors
/// and no packets, but nothing left out that anyone would think of: empty bricks are skipped, a voxel's
/// sums lie in one cache line, rays stop where the program's do. One lattice, samples that do not divide, the
/// posterior rule, an unknown background, the Gaussian agreement.

#include <array>
#include <vector>

#include "roxel/infer/run_pass.h"

namespace roxel {

class ScalarPass {
 public:
  explicit ScalarPass(const Volume& volume);

  /// The first half for one node: begin_color, then the march.
  void begin_color();
  PassCounts march_color(const SampleNode& node, const MarchOptions& options);
  /// The second: what rays are compared with, no sums yet; then the march.
  void begin_opacity(const std::vector<VoxelColor>& compared_with);
  PassCounts march_opacity(const SampleNode& node, const MarchOptions& options);

  /// A whole pass over all nodes, with the update under a prior whose mode is the same everywhere.
  struct Result {
    PassCounts opacity;
    std::vector<double> hits, exposure, tau;  ///< of each slot
  };
  Result run(const std::vector<SampleNode>& nodes, const PassOptions& options);

  /// What rays meet, if none stops early.
  struct Meets {
    double steps = 0, bricks = 0;  ///< a ray that meets any; bricks with voxels
    double voxels_of_square = 0;   ///< of each square of 8 x 8 rays, each counted once a square, a step
  };
  Meets meets(const SampleNode& node) const;

 private:
  struct Step;
  template <class Visit, class BrickDone>
  void walk(const Ray& ray, Stretch range, Visit&& visit, BrickDone&& brick_done) const;

  const Volume& volume_;
  const BrickIndex& index_;
  /// Of each brick, as a plain array: a voxel's slot less the brick's first, or kNone.
  static constexpr std::uint16_t kNone = 0xffff;
  std::vector<std::array<std::uint16_t, kBrickVoxels>> local_;
  std::vector<VoxelScratch> voxels_;
};

}  // namespace roxel

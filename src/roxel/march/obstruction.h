#pragma once
/// What stands between a place in the volume and a light far away.

#include "roxel/march/ray_walk.h"

namespace roxel {

struct Obstruction {
  float transmittance = 1;     ///< of the whole way
  std::uint32_t at = kNoSlot;  ///< the voxel that stops most of what is stopped
};

/// Looks along single rays; one a thread.
class ObstructionMarch {
 public:
  explicit ObstructionMarch(const LatticeStack& stack) : stack_(stack) {}
  /// Along `direction` (unit) from `origin`, in the volume or out of it, to where the lattices end.
  Obstruction look(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

 private:
  static constexpr float kDark = 1e-2f;  ///< transmittance below which nothing comes through
  const LatticeStack& stack_;
  StepChunk chunk_;
};

}  // namespace roxel

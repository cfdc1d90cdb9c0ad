#pragma once
/// For neighbouring samples of a view: the bricks that their rays can meet, in the rays' order.

#include <span>
#include <vector>

#include "roxel/march/ray_walk.h"
#include "roxel/march/sample_plan.h"

namespace roxel {

/// For each pyramid level of a plan and each square of kSide x kSide of its samples: which bricks the rays
/// through them can meet at the depths that the level serves, first those that no ray meets after another of
/// them. Conservative: there may be bricks that no ray meets.
///
/// Within a lattice, bricks are ordered by how many faces between bricks lie between them and the camera's
/// centre, counted axis by axis: whichever way a ray goes, it only gets farther. What lies in surround goes
/// before what it surrounds, or behind it, and never both for one brick, since a plane of the inner lattice's
/// box parts them.
class BrickLists {
 public:
  static constexpr int kSide = 8;  ///< samples

  BrickLists(const LatticeStack& stack, const PinholeCamera& camera, const SamplePlan& plan);

  /// LatticeStack::brick numbers for sample (x, y) of a level of the plan; the same list, at the same place,
  /// for all samples of a square.
  std::span<const std::uint32_t> at(int level, int x, int y) const {
    const Level& l = levels_[level - finest_level_];
    const std::size_t tile = static_cast<std::size_t>(y / kSide) * l.columns + x / kSide;
    return {bricks_.data() + l.first[tile], bricks_.data() + l.first[tile + 1]};
  }
  /// Whether neither the sample nor any that it divides into can meet a brick: the same for all samples of a
  /// square.
  bool none_from(int level, int x, int y) const {
    const Level& l = levels_[level - finest_level_];
    return l.none_from[static_cast<std::size_t>(y / kSide) * l.columns + x / kSide] != 0;
  }

 private:
  struct Level {
    int columns = 0;
    std::vector<std::uint32_t> first;     ///< of each square's list, and the end of the last
    std::vector<std::uint8_t> none_from;  ///< of each square
  };
  void look_for_empty_squares();

  int finest_level_;
  std::vector<Level> levels_;  ///< from the finest on
  std::vector<std::uint32_t> bricks_;
};

}  // namespace roxel

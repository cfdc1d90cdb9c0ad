#pragma once
/// Where a brick is seen in an image.

#include <algorithm>
#include <limits>
#include <utility>

#include "roxel/march/ray_walk.h"

namespace roxel {

/// Pixel bounds and depths of what is seen of a brick.
struct BrickOutline {
  double u0, u1, v0, v1;
  Stretch depth;
};

/// Outlines of the bricks of one lattice in one camera's image.
class BrickProjection {
 public:
  /// Rounding must not cost a voxel: bricks count as wider by this many pixels and this share of their depth.
  static constexpr double kMarginPx = 0.01;
  static constexpr double kMarginDepth = 1e-6;

  BrickProjection(const LatticeFrame& frame, const PinholeCamera& camera);

  /// Of what is in front of the camera; nothing there: depth.end <= 0. A brick that reaches behind the camera
  /// is cut at a small depth, or, close to the camera's centre, is everywhere (u, v unbounded).
  BrickOutline outline(const Eigen::Vector3i& brick) const;

  /// Tiles [first, second) of `count` with `side` pixels each that the pixel range [low, high] touches.
  static std::pair<int, int> tiles(double low, double high, double side, int count) {
    const double limit = count * side;
    const double from = std::clamp(low - kMarginPx, 0.0, limit);
    const double to = std::clamp(high + kMarginPx, -1.0, limit);
    if (to < 0 || low - kMarginPx > limit) return {0, 0};
    return {std::min(static_cast<int>(from / side), count - 1),
            std::min(static_cast<int>(to / side), count - 1) + 1};
  }

 private:
  BrickOutline cut_outline(const Eigen::Vector3d corners[8], double nearest) const;

  Eigen::Vector3d edges_[3];  ///< K (R edge): what a brick's edge adds to K (x - centre)
  Eigen::Vector3d origin_;    ///< K R (origin - centre)
};

}  // namespace roxel

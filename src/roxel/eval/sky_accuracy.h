#pragma once
/// A fitted sky against the true one (docs/evaluation.md).

#include <cstdint>
#include <string>

#include "roxel/sky/node_sky.h"
#include "roxel/sky/perez_fit.h"

namespace roxel {

/// Mean over the dome, by solid angle, and channels of |ours / truth - 1|; where truth is 0 a direction does
/// not count. Both maps are equirectangular, of one size; rows above the horizon count.
double dome_error(const Image& ours, const Image& truth);

/// The same model fitted to the true dome itself: what it could do at best. `truth` without the disc; `sun`
/// in the sky's frame.
double oracle_dome_error(const Image& truth, const Eigen::Vector3d& sun, PerezFreedom freedom);

/// Pixels by what two masks say; 128 and above is sky.
struct MaskAgreement {
  std::int64_t both = 0, either = 0;

  /// Counts the pixels of one image; sizes agree. `surface`: 255 where the truth has no sky.
  void add(const Mask& sky, const Mask& surface);
  void add(const MaskAgreement& other) { both += other.both, either += other.either; }
  /// Intersection over union; 1 where neither has sky.
  double iou() const { return either > 0 ? static_cast<double>(both) / static_cast<double>(either) : 1.0; }
};

/// Angle between two directions, degrees.
double angle_between_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace roxel

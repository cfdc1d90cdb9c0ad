#pragma once
/// Cameras that are not quite where their data set says.

#include <cstdint>
#include <vector>

#include "roxel/camera/camera.h"

namespace roxel {

/// Standard deviations: of the angle about each of three axes, and of each coordinate of the centre.
struct PoseNoise {
  double rotation_deg = 0;
  double translation = 0;  ///< world units
  bool any() const { return rotation_deg > 0 || translation > 0; }
};

/// The cameras with normally distributed errors. Cameras with one optical centre err together, as a node that
/// was joined first and placed then.
std::vector<PinholeCamera> with_pose_noise(std::vector<PinholeCamera> cameras, const PoseNoise& noise,
                                           std::uint32_t seed);

}  // namespace roxel

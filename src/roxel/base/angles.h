#pragma once
/// Constants of angles, in radians.

#include <numbers>

namespace roxel {

inline constexpr double kPi = std::numbers::pi;
inline constexpr float kPiFloat = std::numbers::pi_v<float>;
inline constexpr double kDegree = kPi / 180;

}  // namespace roxel

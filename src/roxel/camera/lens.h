#pragma once
/// Lens distortion models, named and parameterised as COLMAP does.

#include <Eigen/Core>
#include <array>

#include "roxel/camera/camera.h"

namespace roxel {

enum class LensModel {
  kPinhole,               ///< no distortion
  kSimpleRadial,          ///< k1
  kRadial,                ///< k1 k2
  kOpenCv,                ///< k1 k2 p1 p2
  kFullOpenCv,            ///< k1 k2 p1 p2 k3 k4 k5 k6
  kSimpleRadialFisheye,   ///< k1
  kRadialFisheye,         ///< k1 k2
  kOpenCvFisheye,         ///< k1 k2 k3 k4
  kThinPrismFisheye,      ///< k1 k2 p1 p2 k3 k4 sx1 sy1
  kFov,                   ///< omega
};

/// A camera as its image file has it: intrinsics and distortion coefficients in the order of the comments above.
struct Lens {
  LensModel model = LensModel::kPinhole;
  Intrinsics intrinsics;
  std::array<double, 8> coefficients{};
};

}  // namespace roxel

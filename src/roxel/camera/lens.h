#pragma once
/// Lens distortion models, named and parameterised as COLMAP does (its sensor/models).
///
/// A point at x_in_camera has the *normalised* position (x/z, y/z); the lens moves it to the *distorted*
/// position, and the intrinsics turn that into pixels: pixel = K distort(x_in_camera / z). With
/// r = |normalised|, theta = atan r, a polynomial lens bends outward or inward by a factor of its radius;
/// every model is one to one only up to some radius (`valid_radius`), past which it folds back.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>

#include "roxel/camera/camera.h"

namespace roxel {

/// In the formulas (u, v) is the normalised position, or for the fisheye models that position scaled by
/// theta / r, and r^2 = u^2 + v^2. [Devernay01] for kFov.
enum class LensModel {
  kPinhole,       ///< no distortion
  kSimpleRadial,  ///< k1: factor 1 + k1 r^2
  kRadial,        ///< k1 k2: factor 1 + k1 r^2 + k2 r^4
  kOpenCv,        ///< k1 k2 p1 p2: kRadial + (2 p1 uv + p2 (r^2 + 2u^2), 2 p2 uv + p1 (r^2 + 2v^2))
  kFullOpenCv,  ///< k1 k2 p1 p2 k3 k4 k5 k6: (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + ...) + kOpenCv's
                ///< p
  kSimpleRadialFisheye,  ///< k1: as kSimpleRadial
  kRadialFisheye,        ///< k1 k2: as kRadial
  kOpenCvFisheye,        ///< k1 k2 k3 k4: factor 1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8
  kThinPrismFisheye,  ///< k1 k2 p1 p2 k3 k4 sx1 sy1: kOpenCvFisheye's factor + kOpenCv's p + r^2 (sx1, sy1)
  kFov,               ///< omega: distorted radius atan(2 r tan(omega / 2)) / omega
};

/// A camera as its image file has it: intrinsics and distortion coefficients in the order of the comments
/// above.
struct Lens {
  LensModel model = LensModel::kPinhole;
  Intrinsics intrinsics;
  std::array<double, 8> coefficients{};

  bool operator==(const Lens&) const = default;
};

/// Number of leading coefficients that `model` reads.
int coefficient_count(LensModel model);

/// False where distort is the identity: no model, or coefficients that are all zero (fisheye models bend even
/// then).
bool has_distortion(const Lens& lens);

/// Throws InvalidInput, starting with `where`, unless image size and focal lengths are positive, every
/// number is finite, and the model is one to one around the image's centre.
void check_lens(const Lens& lens, const std::string& where);

/// Distorted position of a normalised one; the formula itself, also past the valid radius. Departs from
/// COLMAP in one place: for |omega| < 0.01 COLMAP's series for kFov has the sign of its inverse.
Eigen::Vector2d distort(const Lens& lens, const Eigen::Vector2d& x_normalised);

/// The same with `jacobian` = d distorted / d normalised (analytic).
Eigen::Vector2d distort(const Lens& lens, const Eigen::Vector2d& x_normalised, Eigen::Matrix2d& jacobian);

/// The largest |normalised| up to which the model is one to one in every direction: the first radius at
/// which the Jacobian's determinant vanishes, at most tan(85 degrees); 0 where it is not positive at the
/// centre.
double valid_radius(const Lens& lens);

/// The normalised position within `radius` (from valid_radius) that distort takes to x_distorted, or nothing
/// where there is none. Exact to 1e-12.
std::optional<Eigen::Vector2d> undistort_point(const Lens& lens, const Eigen::Vector2d& x_distorted,
                                               double radius);
std::optional<Eigen::Vector2d> undistort_point(const Lens& lens, const Eigen::Vector2d& x_distorted);

/// Pixel position of a point that the *file's* camera sees at x_in_camera; nothing where it lies behind the
/// camera or past the valid radius. For checking calibrations; the algorithms use PinholeCamera.
std::optional<Eigen::Vector2d> project(const Lens& lens, const Eigen::Vector3d& x_in_camera);

}  // namespace roxel

#pragma once
/// Checks and conversions of cameras that the data-set readers share. Every failure is an InvalidInput.

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "roxel/camera/lens.h"
#include "roxel/dataset/dataset.h"

namespace roxel {

/// Largest entry by which R R^T may differ from the identity, and by which a quaternion's length may differ
/// from 1. Files carry from four digits upwards.
inline constexpr double kRotationTolerance = 1e-3;

/// The rotation nearest to `matrix`. Throws unless it is orthonormal within kRotationTolerance, det +1.
Eigen::Matrix3d checked_rotation(const Eigen::Matrix3d& matrix, const std::string& where);

/// (w, x, y, z), normalised. Throws where its length is not 1 within kRotationTolerance.
Eigen::Matrix3d rotation_from_quaternion(const Eigen::Vector4d& wxyz, const std::string& where);

/// The inverse, w >= 0.
Eigen::Vector4d quaternion_from_rotation(const Eigen::Matrix3d& rotation);

/// fx, fy, cx, cy and skew of an upper triangular K, divided by K(2,2); width and height are left 0.
/// Throws where entries that must be 0 are not, or a focal length is not positive.
Intrinsics intrinsics_from_matrix(const Eigen::Matrix3d& k, const std::string& where);

/// The row-major 3 x 3 matrix in values[first .. first + 9).
Eigen::Matrix3d matrix_from_rows(const std::vector<double>& values, std::size_t first);

/// COLMAP's name of each lens model, e.g. "OPENCV"; PINHOLE stands for kPinhole.
const char* lens_model_name(LensModel model);

/// Names of a model's coefficients in the order of Lens::coefficients, e.g. {"k1", "k2", "p1", "p2"}.
std::vector<std::string> lens_coefficient_names(LensModel model);

/// `path` without its last suffix: "a/b.tar.png" becomes "a/b.tar".
std::string without_suffix(const std::string& path);

}  // namespace roxel

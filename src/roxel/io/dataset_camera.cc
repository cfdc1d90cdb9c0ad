#include "roxel/io/dataset_camera.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <cmath>
#include <sstream>

#include "roxel/base/error.h"

namespace roxel {
namespace {

std::string on_one_line(const Eigen::Matrix3d& matrix) {
  std::ostringstream out;
  out.precision(9);
  out << matrix.format(
      Eigen::IOFormat(Eigen::StreamPrecision, Eigen::DontAlignCols, " ", "; ", "", "", "[", "]"));
  return out.str();
}

std::string text(double value) {
  std::ostringstream out;
  out.precision(9);
  out << value;
  return out.str();
}

}  // namespace

Eigen::Matrix3d checked_rotation(const Eigen::Matrix3d& matrix, const std::string& where) {
  if (!matrix.allFinite()) throw_invalid(where, on_one_line(matrix), "finite numbers");
  const double off = (matrix * matrix.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (off > kRotationTolerance) {
    throw_invalid(where, on_one_line(matrix) + ", whose rows miss orthonormality by " + text(off),
                  "a rotation matrix, R R^T within " + text(kRotationTolerance) + " of the identity");
  }
  if (matrix.determinant() < 0) {
    throw_invalid(where, on_one_line(matrix) + " with determinant -1 (a reflection)",
                  "a rotation matrix with determinant +1");
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

Eigen::Matrix3d rotation_from_quaternion(const Eigen::Vector4d& wxyz, const std::string& where) {
  const double length = wxyz.norm();
  if (!(std::abs(length - 1) <= kRotationTolerance)) {
    std::ostringstream found;
    found << "quaternion " << wxyz.transpose() << " of length " << text(length);
    throw_invalid(where, found.str(), "a unit quaternion (within " + text(kRotationTolerance) + ")");
  }
  return Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized().toRotationMatrix();
}

Eigen::Vector4d quaternion_from_rotation(const Eigen::Matrix3d& rotation) {
  const Eigen::Quaterniond q(rotation);
  const Eigen::Vector4d wxyz(q.w(), q.x(), q.y(), q.z());
  return q.w() < 0 ? Eigen::Vector4d(-wxyz) : wxyz;
}

Intrinsics intrinsics_from_matrix(const Eigen::Matrix3d& k, const std::string& where) {
  const bool upper = k.allFinite() && k(2, 2) != 0 && k(1, 0) == 0 && k(2, 0) == 0 && k(2, 1) == 0;
  if (!upper) throw_invalid(where + ": K", on_one_line(k), "[fx skew cx; 0 fy cy; 0 0 1]");
  Intrinsics result;
  result.fx = k(0, 0) / k(2, 2);
  result.fy = k(1, 1) / k(2, 2);
  result.skew = k(0, 1) / k(2, 2);
  result.cx = k(0, 2) / k(2, 2);
  result.cy = k(1, 2) / k(2, 2);
  if (!(result.fx > 0)) throw_invalid(where + ": fx", text(result.fx), "a focal length above 0");
  if (!(result.fy > 0)) throw_invalid(where + ": fy", text(result.fy), "a focal length above 0");
  return result;
}

Eigen::Matrix3d matrix_from_rows(const std::vector<double>& values, std::size_t first) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data() + first);
}

const char* lens_model_name(LensModel model) {
  switch (model) {
    case LensModel::kPinhole:
      return "PINHOLE";
    case LensModel::kSimpleRadial:
      return "SIMPLE_RADIAL";
    case LensModel::kRadial:
      return "RADIAL";
    case LensModel::kOpenCv:
      return "OPENCV";
    case LensModel::kFullOpenCv:
      return "FULL_OPENCV";
    case LensModel::kSimpleRadialFisheye:
      return "SIMPLE_RADIAL_FISHEYE";
    case LensModel::kRadialFisheye:
      return "RADIAL_FISHEYE";
    case LensModel::kOpenCvFisheye:
      return "OPENCV_FISHEYE";
    case LensModel::kThinPrismFisheye:
      return "THIN_PRISM_FISHEYE";
    case LensModel::kFov:
      return "FOV";
  }
  return "";
}

std::vector<std::string> lens_coefficient_names(LensModel model) {
  switch (model) {
    case LensModel::kPinhole:
      return {};
    case LensModel::kSimpleRadial:
    case LensModel::kSimpleRadialFisheye:
      return {"k1"};
    case LensModel::kRadial:
    case LensModel::kRadialFisheye:
      return {"k1", "k2"};
    case LensModel::kOpenCv:
      return {"k1", "k2", "p1", "p2"};
    case LensModel::kFullOpenCv:
      return {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
    case LensModel::kOpenCvFisheye:
      return {"k1", "k2", "k3", "k4"};
    case LensModel::kThinPrismFisheye:
      return {"k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1"};
    case LensModel::kFov:
      return {"omega"};
  }
  return {};
}

std::string without_suffix(const std::string& path) {
  return std::filesystem::path(path).replace_extension().string();
}

}  // namespace roxel

#include "roxel/camera/lens.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

/// A function of a squared radius, and its derivative by it.
struct Factor {
  double value;
  double slope;
};

bool is_fisheye(LensModel model) {
  return model == LensModel::kSimpleRadialFisheye || model == LensModel::kRadialFisheye ||
         model == LensModel::kOpenCvFisheye || model == LensModel::kThinPrismFisheye;
}

/// 1 + c0 q + c1 q^2 + ..., by Horner's rule.
Factor polynomial(double q, std::initializer_list<double> c) {
  Factor f{0, 0};
  for (auto k = std::rbegin(c); k != std::rend(c); ++k) {
    f.slope = f.slope * q + f.value + *k;
    f.value = (f.value + *k) * q;
  }
  return {1 + f.value, f.slope};
}

/// atan(z) / z as a function of q = z^2.
Factor atan_ratio(double q) {
  if (q < 1e-4) return {1 - q / 3 + q * q / 5 - q * q * q / 7, -1.0 / 3 + 2 * q / 5 - 3 * q * q / 7};
  const double z = std::sqrt(q);
  const double value = std::atan(z) / z;
  return {value, (1 / (1 + q) - value) / (2 * q)};
}

Factor fov_factor(double omega, double q) {
  const double slope_at_centre = 2 * std::tan(omega / 2);
  const double stretch = slope_at_centre * slope_at_centre;
  const Factor ratio = atan_ratio(stretch * q);
  const double scale = slope_at_centre / omega;
  return {scale * ratio.value, scale * stretch * ratio.slope};
}

/// What the radial part multiplies (u, v) by, of q = u^2 + v^2.
Factor radial_factor(const Lens& lens, double q) {
  const auto& c = lens.coefficients;
  switch (lens.model) {
    case LensModel::kPinhole:
      return {1, 0};
    case LensModel::kSimpleRadial:
    case LensModel::kSimpleRadialFisheye:
      return polynomial(q, {c[0]});
    case LensModel::kRadial:
    case LensModel::kRadialFisheye:
    case LensModel::kOpenCv:
      return polynomial(q, {c[0], c[1]});
    case LensModel::kOpenCvFisheye:
      return polynomial(q, {c[0], c[1], c[2], c[3]});
    case LensModel::kThinPrismFisheye:
      return polynomial(q, {c[0], c[1], c[4], c[5]});
    case LensModel::kFullOpenCv: {
      const Factor n = polynomial(q, {c[0], c[1], c[4]});
      const Factor d = polynomial(q, {c[5], c[6], c[7]});
      return {n.value / d.value, (n.slope * d.value - n.value * d.slope) / (d.value * d.value)};
    }
    case LensModel::kFov:
      return c[0] == 0 ? Factor{1, 0} : fov_factor(c[0], q);
  }
  return {1, 0};
}

/// The decentring and prism terms; all zero where the model is purely radial.
struct Decentring {
  double p1 = 0, p2 = 0, sx = 0, sy = 0;

  bool none() const { return p1 == 0 && p2 == 0 && sx == 0 && sy == 0; }
};

Decentring decentring(const Lens& lens) {
  const auto& c = lens.coefficients;
  switch (lens.model) {
    case LensModel::kOpenCv:
    case LensModel::kFullOpenCv:
      return {c[2], c[3], 0, 0};
    case LensModel::kThinPrismFisheye:
      return {c[2], c[3], c[6], c[7]};
    default:
      return {};
  }
}

/// x f(|x|^2) and its Jacobian f I + 2 f' x x^T.
Vector2d scaled(const Vector2d& x, const Factor& f, Matrix2d& jacobian) {
  jacobian = f.value * Matrix2d::Identity() + 2 * f.slope * x * x.transpose();
  return f.value * x;
}

Vector2d bent(const Lens& lens, const Vector2d& w, Matrix2d& jacobian) {
  const double q = w.squaredNorm();
  Vector2d y = scaled(w, radial_factor(lens, q), jacobian);
  const Decentring d = decentring(lens);
  if (d.none()) return y;
  const double u = w.x(), v = w.y();
  y.x() += 2 * d.p1 * u * v + d.p2 * (q + 2 * u * u) + d.sx * q;
  y.y() += 2 * d.p2 * u * v + d.p1 * (q + 2 * v * v) + d.sy * q;
  jacobian(0, 0) += 2 * d.p1 * v + 6 * d.p2 * u + 2 * d.sx * u;
  jacobian(0, 1) += 2 * d.p1 * u + 2 * d.p2 * v + 2 * d.sx * v;
  jacobian(1, 0) += 2 * d.p2 * v + 2 * d.p1 * u + 2 * d.sy * u;
  jacobian(1, 1) += 2 * d.p2 * u + 6 * d.p1 * v + 2 * d.sy * v;
  return y;
}

constexpr double kLargestAngle = 85 * std::numbers::pi / 180;

double determinant_at(const Lens& lens, double angle, double direction) {
  const double r = std::tan(angle);
  Matrix2d jacobian;
  distort(lens, Vector2d(r * std::cos(direction), r * std::sin(direction)), jacobian);
  return jacobian.determinant();
}

/// The smallest determinant around the circle at `angle` from the axis. NaN (a pole) counts as a fold.
double smallest_determinant(const Lens& lens, double angle, int directions) {
  double smallest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < directions; ++i) {
    const double d = determinant_at(lens, angle, 2 * std::numbers::pi * i / directions);
    if (!(d > 0)) return -1;
    smallest = std::min(smallest, d);
  }
  return smallest;
}

/// Newton's method from `x` with steps halved until the error falls; nothing when it stalls or leaves the
/// disc.
std::optional<Vector2d> newton(const Lens& lens, const Vector2d& target, Vector2d x, double radius) {
  Matrix2d jacobian;
  Vector2d error = distort(lens, x, jacobian) - target;
  for (int iteration = 0; iteration < 50; ++iteration) {
    if (error.norm() <= 1e-14 * (1 + target.norm())) break;
    const Vector2d step = jacobian.inverse() * error;
    double scale = 1;
    for (; scale > 1e-6; scale /= 2) {
      const Vector2d next = x - scale * step;
      Matrix2d next_jacobian;
      const Vector2d next_error = distort(lens, next, next_jacobian) - target;
      if (next.norm() > radius || !(next_error.norm() < error.norm())) continue;
      x = next, error = next_error, jacobian = next_jacobian;
      break;
    }
    if (scale <= 1e-6) break;
  }
  if (!(error.norm() <= 1e-12 * (1 + target.norm()))) return std::nullopt;
  return x;
}

/// Radial models keep directions: one unknown, bracketed by [0, radius], on which the radius grows.
std::optional<Vector2d> undistort_radial(const Lens& lens, const Vector2d& target, double radius) {
  const double wanted = target.norm();
  if (wanted == 0) return target;
  const auto error_at = [&](double r, double& slope) {
    Matrix2d jacobian;
    const double error = distort(lens, Vector2d(r, 0), jacobian).x() - wanted;
    slope = jacobian(0, 0);
    return error;
  };
  double slope = 0, low = 0, high = radius;
  if (!(error_at(radius, slope) >= 0)) return std::nullopt;
  double r = std::min(wanted, radius);
  for (int iteration = 0; iteration < 200 && high - low > 1e-15 * high; ++iteration) {
    const double error = error_at(r, slope);
    if (error == 0) break;
    (error > 0 ? high : low) = r;
    const double next = r - error / slope;
    const bool inside = next > low && next < high;
    if (inside && std::abs(next - r) <= 1e-16 * r) break;
    r = inside ? next : (low + high) / 2;
  }
  return Vector2d(target * (r / wanted));
}

}  // namespace

int coefficient_count(LensModel model) {
  switch (model) {
    case LensModel::kPinhole:
      return 0;
    case LensModel::kSimpleRadial:
    case LensModel::kSimpleRadialFisheye:
    case LensModel::kFov:
      return 1;
    case LensModel::kRadial:
    case LensModel::kRadialFisheye:
      return 2;
    case LensModel::kOpenCv:
    case LensModel::kOpenCvFisheye:
      return 4;
    case LensModel::kFullOpenCv:
    case LensModel::kThinPrismFisheye:
      return 8;
  }
  return 0;
}

bool has_distortion(const Lens& lens) {
  if (is_fisheye(lens.model)) return true;
  const auto begin = lens.coefficients.begin();
  return std::any_of(begin, begin + coefficient_count(lens.model), [](double c) { return c != 0; });
}

void check_lens(const Lens& lens, const std::string& where) {
  const Intrinsics& k = lens.intrinsics;
  if (k.width <= 0 || k.height <= 0)
    throw_invalid(where, "image size " + std::to_string(k.width) + " x " + std::to_string(k.height),
                  "a positive width and height");
  for (const double f : {k.fx, k.fy})
    if (!(f > 0) || !std::isfinite(f))
      throw_invalid(where, "focal length " + std::to_string(f), "a positive number of pixels");
  for (const double c : {k.cx, k.cy, k.skew})
    if (!std::isfinite(c))
      throw_invalid(where, "principal point or skew " + std::to_string(c), "a finite number of pixels");
  for (int i = 0; i < coefficient_count(lens.model); ++i)
    if (!std::isfinite(lens.coefficients[i]))
      throw_invalid(where, "distortion coefficient " + std::to_string(lens.coefficients[i]),
                    "a finite number");
  if (lens.model == LensModel::kFov && std::abs(lens.coefficients[0]) >= std::numbers::pi)
    throw_invalid(where, "omega " + std::to_string(lens.coefficients[0]), "an angle below pi");
  if (!(valid_radius(lens) > 0))
    throw_invalid(where, "a distortion that folds at the principal point",
                  "a model that is one to one there");
}

Vector2d distort(const Lens& lens, const Vector2d& x_normalised, Matrix2d& jacobian) {
  if (!is_fisheye(lens.model)) return bent(lens, x_normalised, jacobian);
  Matrix2d inner, outer;
  const Vector2d w = scaled(x_normalised, atan_ratio(x_normalised.squaredNorm()), inner);
  const Vector2d y = bent(lens, w, outer);
  jacobian = outer * inner;
  return y;
}

Vector2d distort(const Lens& lens, const Vector2d& x_normalised) {
  Matrix2d jacobian;
  return distort(lens, x_normalised, jacobian);
}

double valid_radius(const Lens& lens) {
  const int directions = decentring(lens).none() ? 1 : 32;
  const auto folded = [&](double angle) { return !(smallest_determinant(lens, angle, directions) > 0); };
  if (folded(0)) return 0;
  constexpr int kSteps = 512;
  double low = 0, high = 0;
  for (int i = 1; i <= kSteps; ++i) {
    high = kLargestAngle * i / kSteps;
    if (folded(high)) break;
    low = high;
  }
  // The fold lies between the last circle without one and the first with one.
  while (high - low > 1e-14) {
    const double middle = (low + high) / 2;
    if (middle <= low || middle >= high) break;
    (folded(middle) ? high : low) = middle;
  }
  return std::tan(low);
}

std::optional<Vector2d> undistort_point(const Lens& lens, const Vector2d& x_distorted, double radius) {
  if (!x_distorted.allFinite()) return std::nullopt;
  if (!has_distortion(lens)) return x_distorted.norm() <= radius ? std::optional(x_distorted) : std::nullopt;
  if (decentring(lens).none()) return undistort_radial(lens, x_distorted, radius);
  // Follow the solution outward from the axis when one leap does not get there.
  for (const int steps : {1, 16}) {
    std::optional<Vector2d> x = Vector2d(0, 0);
    for (int i = 1; i <= steps && x; ++i) x = newton(lens, x_distorted * i / steps, *x, radius);
    if (x) return x;
  }
  return std::nullopt;
}

std::optional<Vector2d> undistort_point(const Lens& lens, const Vector2d& x_distorted) {
  return undistort_point(lens, x_distorted, valid_radius(lens));
}

std::optional<Vector2d> project(const Lens& lens, const Eigen::Vector3d& x_in_camera) {
  if (!(x_in_camera.z() > 0)) return std::nullopt;
  const Vector2d x = x_in_camera.head<2>() / x_in_camera.z();
  if (has_distortion(lens) && x.norm() > valid_radius(lens)) return std::nullopt;
  return pixel_from_normalised(lens.intrinsics, distort(lens, x));
}

}  // namespace roxel

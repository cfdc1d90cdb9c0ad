#include "roxel/camera/lens.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Lens lens(LensModel model, std::array<double, 8> coefficients = {}) {
  return {model, {640, 480, 500, 500, 320, 240, 0}, coefficients};
}

/// One strong but plausible lens of every model, and some that fold inside a wide view.
std::vector<Lens> all_lenses() {
  return {lens(LensModel::kPinhole),
          lens(LensModel::kSimpleRadial, {-0.55}),
          lens(LensModel::kSimpleRadial, {0.2}),
          lens(LensModel::kRadial, {-0.3, 0.08}),
          lens(LensModel::kOpenCv, {-0.28, 0.07, 0.002, -0.003}),
          lens(LensModel::kFullOpenCv, {0.6, -0.2, 0.001, 0.0005, 0.03, 0.9, -0.1, 0.02}),
          lens(LensModel::kSimpleRadialFisheye, {-0.02}),
          lens(LensModel::kRadialFisheye, {0.03, -0.01}),
          lens(LensModel::kOpenCvFisheye, {-0.01, 0.008, -0.006, 0.001}),
          lens(LensModel::kThinPrismFisheye, {-0.02, 0.01, 0.001, -0.002, -0.004, 0.0005, 0.002, -0.001}),
          lens(LensModel::kFov, {0.9}),
          lens(LensModel::kFov, {0.005})};
}

/// A lens with its valid radius, which costs far more than one point.
struct Sample {
  Lens lens;
  double radius;
};

const std::vector<Sample>& samples() {
  static const std::vector<Sample> all = [] {
    std::vector<Sample> result;
    for (const Lens& l : all_lenses()) result.push_back({l, valid_radius(l)});
    return result;
  }();
  return all;
}

double to_unit(unsigned x) { return (x % 1000003) / 1000002.0; }

/// A position inside the valid disc, and inside a cone of 75 degrees.
Vector2d position(double radius, unsigned a, unsigned b) {
  const double r = 0.995 * to_unit(a) * std::min(radius, std::tan(75 * std::numbers::pi / 180));
  const double angle = 2 * std::numbers::pi * to_unit(b);
  return {r * std::cos(angle), r * std::sin(angle)};
}

// Hand-computed values at (u, v) = (0.3, -0.4): r^2 = 0.25, r = 0.5, uv = -0.12.

TEST(Lens, SimpleRadialValue) {
  const Vector2d y = distort(lens(LensModel::kSimpleRadial, {-0.2}), {0.3, -0.4});
  EXPECT_NEAR(y.x(), 0.3 * 0.95, 1e-15);
  EXPECT_NEAR(y.y(), -0.4 * 0.95, 1e-15);
}

TEST(Lens, RadialValue) {
  const Vector2d y = distort(lens(LensModel::kRadial, {-0.2, 0.4}), {0.3, -0.4});
  EXPECT_NEAR(y.x(), 0.3 * 0.975, 1e-15);  // 1 - 0.2 * 0.25 + 0.4 * 0.0625
  EXPECT_NEAR(y.y(), -0.4 * 0.975, 1e-15);
}

TEST(Lens, OpenCvValue) {
  const Vector2d y = distort(lens(LensModel::kOpenCv, {-0.2, 0.4, 0.01, 0.02}), {0.3, -0.4});
  EXPECT_NEAR(y.x(), 0.3 * 0.975 + 2 * 0.01 * -0.12 + 0.02 * (0.25 + 2 * 0.09), 1e-15);
  EXPECT_NEAR(y.y(), -0.4 * 0.975 + 2 * 0.02 * -0.12 + 0.01 * (0.25 + 2 * 0.16), 1e-15);
}

TEST(Lens, FullOpenCvValue) {
  const Vector2d y =
      distort(lens(LensModel::kFullOpenCv, {-0.2, 0.4, 0.01, 0.02, 0.64, 0.4, 0.16, 0.32}), {0.3, -0.4});
  const double radial = (1 - 0.05 + 0.025 + 0.01) / (1 + 0.1 + 0.01 + 0.005);
  EXPECT_NEAR(y.x(), 0.3 * radial + 0.0062, 1e-15);
  EXPECT_NEAR(y.y(), -0.4 * radial + 0.0009, 1e-15);
}

TEST(Lens, FisheyeValues) {
  const double theta = std::atan(0.5), t2 = theta * theta;
  const Vector2d along(0.6, -0.8);
  const auto near = [](const Vector2d& a, const Vector2d& b) { return (a - b).norm() < 1e-15; };
  const Vector2d x(0.3, -0.4);
  EXPECT_PRED2(near, distort(lens(LensModel::kSimpleRadialFisheye, {0.1}), x),
               along * theta * (1 + 0.1 * t2));
  EXPECT_PRED2(near, distort(lens(LensModel::kRadialFisheye, {0.1, -0.2}), x),
               along * theta * (1 + 0.1 * t2 - 0.2 * t2 * t2));
  EXPECT_PRED2(near, distort(lens(LensModel::kOpenCvFisheye, {0.1, -0.2, 0.3, -0.4}), x),
               along * theta * (1 + 0.1 * t2 - 0.2 * t2 * t2 + 0.3 * t2 * t2 * t2 - 0.4 * t2 * t2 * t2 * t2));
}

TEST(Lens, ThinPrismFisheyeValue) {
  const double theta = std::atan(0.5), t2 = theta * theta;
  const double u = 0.6 * theta, v = -0.8 * theta;
  const double radial = 1 + 0.1 * t2 - 0.2 * t2 * t2 + 0.3 * t2 * t2 * t2 - 0.4 * t2 * t2 * t2 * t2;
  const Vector2d y = distort(
      lens(LensModel::kThinPrismFisheye, {0.1, -0.2, 0.01, 0.02, 0.3, -0.4, 0.05, 0.06}), {0.3, -0.4});
  EXPECT_NEAR(y.x(), u * radial + 2 * 0.01 * u * v + 0.02 * (t2 + 2 * u * u) + 0.05 * t2, 1e-15);
  EXPECT_NEAR(y.y(), v * radial + 2 * 0.02 * u * v + 0.01 * (t2 + 2 * v * v) + 0.06 * t2, 1e-15);
}

TEST(Lens, FovValue) {
  const double radius = std::atan(2 * 0.5 * std::tan(0.45)) / 0.9;
  EXPECT_NEAR(distort(lens(LensModel::kFov, {0.9}), {0.3, -0.4}).x(), 0.6 * radius, 1e-15);
  // For omega -> 0: 1 + omega^2 (1 / 12 - r^2 / 3).
  const double small = 0.5 * (1 + 1e-6 * (1.0 / 12 - 0.25 / 3));
  EXPECT_NEAR(distort(lens(LensModel::kFov, {0.001}), {0.3, -0.4}).norm(), small, 1e-12);
  EXPECT_EQ(distort(lens(LensModel::kFov, {0}), {0.3, -0.4}), Vector2d(0.3, -0.4));
}

TEST(Lens, FisheyeAtTheCentreIsSmooth) {
  for (const Lens& l : all_lenses()) {
    Matrix2d jacobian;
    EXPECT_EQ(distort(l, {0, 0}, jacobian), Vector2d(0, 0));
    const Vector2d tiny = distort(l, {1e-9, 2e-9});
    EXPECT_LT((tiny - jacobian * Vector2d(1e-9, 2e-9)).norm(), 1e-17);
  }
}

RC_GTEST_PROP(Lens, JacobianMatchesCentralDifferences, (unsigned a, unsigned b)) {
  for (const auto& [l, radius] : samples()) {
    const Vector2d x = position(radius, a, b);
    Matrix2d jacobian;
    distort(l, x, jacobian);
    const double h = 1e-6 * (1 + x.norm());
    for (int i = 0; i < 2; ++i) {
      const Vector2d step = h * Vector2d::Unit(i);
      const Vector2d difference = (distort(l, x + step) - distort(l, x - step)) / (2 * h);
      RC_ASSERT((difference - jacobian.col(i)).norm() < 1e-7 * (1 + jacobian.norm()));
    }
  }
}

RC_GTEST_PROP(Lens, UndistortInvertsDistort, (unsigned a, unsigned b)) {
  for (const auto& [l, radius] : samples()) {
    const Vector2d x = position(radius, a, b);
    const auto back = undistort_point(l, distort(l, x), radius);
    RC_ASSERT(back.has_value());
    // The fold has a vanishing derivative, so what can be promised there is the residual.
    RC_ASSERT((distort(l, *back) - distort(l, x)).norm() < 1e-11 * (1 + x.norm()));
    if (x.norm() < 0.9 * radius) RC_ASSERT((*back - x).norm() < 1e-9 * (1 + x.squaredNorm()));
  }
}

RC_GTEST_PROP(Lens, DistortedRadiusGrowsUpToTheValidRadius, (unsigned b)) {
  for (const auto& [l, radius] : samples()) {
    const double end = std::atan(radius);
    double last = 0;
    for (int i = 1; i <= 200; ++i) {
      const double r = std::tan(end * i / 200), angle = 2 * std::numbers::pi * to_unit(b);
      const double distorted = distort(l, Vector2d(r * std::cos(angle), r * std::sin(angle))).norm();
      RC_ASSERT(distorted > last);
      last = distorted;
    }
  }
}

TEST(Lens, ValidRadiusOfOneCoefficientIsTheDerivativesRoot) {
  EXPECT_NEAR(valid_radius(lens(LensModel::kSimpleRadial, {-0.55})), std::sqrt(1 / (3 * 0.55)), 1e-9);
  // Fisheye: theta (1 + k theta^2) turns back at theta = sqrt(1 / 3k) = 1.1547 for k = -0.25.
  EXPECT_NEAR(valid_radius(lens(LensModel::kSimpleRadialFisheye, {-0.25})), std::tan(std::sqrt(4.0 / 3)),
              1e-7);
}

TEST(Lens, ValidRadiusWithoutFoldIs85Degrees) {
  const double limit = std::tan(85 * std::numbers::pi / 180);
  EXPECT_NEAR(valid_radius(lens(LensModel::kSimpleRadial, {0.1})), limit, 1e-9);
  EXPECT_NEAR(valid_radius(lens(LensModel::kFov, {1.2})), limit, 1e-9);
  EXPECT_NEAR(valid_radius(lens(LensModel::kOpenCvFisheye)), limit, 1e-9);
}

TEST(Lens, ValidRadiusEndsBeforeAPole) {
  // 1 / (1 - r^2) has its pole at r = 1.
  EXPECT_NEAR(valid_radius(lens(LensModel::kFullOpenCv, {0, 0, 0, 0, 0, -1})), 1, 1e-6);
}

TEST(Lens, NothingIsPastTheFold) {
  const Lens l = lens(LensModel::kSimpleRadial, {-0.55});
  const double r = std::sqrt(1 / (3 * 0.55)), widest = r * (1 - 0.55 * r * r);
  EXPECT_TRUE(undistort_point(l, {widest * 0.9999, 0}).has_value());
  EXPECT_FALSE(undistort_point(l, {widest * 1.0001, 0}).has_value());
  EXPECT_FALSE(undistort_point(l, {0, std::nan("")}).has_value());
}

TEST(Lens, FisheyeSeesNoPinholeDirectionAtRightAngles) {
  const Lens l = lens(LensModel::kOpenCvFisheye);
  EXPECT_TRUE(undistort_point(l, {84 * std::numbers::pi / 180, 0}).has_value());
  EXPECT_FALSE(undistort_point(l, {86 * std::numbers::pi / 180, 0}).has_value());
  EXPECT_FALSE(undistort_point(l, {2, 0}).has_value());
}

TEST(Lens, ProjectAppliesDistortionThenIntrinsics) {
  const Lens l = lens(LensModel::kSimpleRadial, {-0.2});
  const auto pixel = project(l, {0.6, -0.8, 2});
  ASSERT_TRUE(pixel.has_value());
  EXPECT_NEAR(pixel->x(), 500 * 0.285 + 320, 1e-12);
  EXPECT_NEAR(pixel->y(), -500 * 0.38 + 240, 1e-12);
  EXPECT_FALSE(project(l, {0, 0, -1}).has_value());
  EXPECT_FALSE(project(l, {10, 0, 1}).has_value());
}

TEST(Lens, HasDistortionOnlyWhereSomethingBends) {
  EXPECT_FALSE(has_distortion(lens(LensModel::kPinhole, {1})));
  EXPECT_FALSE(has_distortion(lens(LensModel::kOpenCv)));
  EXPECT_FALSE(has_distortion(lens(LensModel::kSimpleRadial, {0, 0.5})));
  EXPECT_TRUE(has_distortion(lens(LensModel::kOpenCv, {0, 0, 0, 1e-9})));
  EXPECT_TRUE(has_distortion(lens(LensModel::kOpenCvFisheye)));
}

TEST(CheckLens, NamesWhatIsWrong) {
  const auto message = [](Lens l, const std::string& expected) {
    EXPECT_THAT(
        [&] { check_lens(l, "cameras.txt:3"); },
        ThrowsMessage<InvalidInput>(::testing::AllOf(HasSubstr("cameras.txt:3"), HasSubstr(expected))));
  };
  Lens l = lens(LensModel::kPinhole);
  EXPECT_NO_THROW(check_lens(l, ""));
  l.intrinsics.width = 0;
  message(l, "image size 0 x 480");
  l = lens(LensModel::kPinhole);
  l.intrinsics.fy = 0;
  message(l, "focal length 0.0");
  l.intrinsics.fy = std::nan("");
  message(l, "focal length nan");
  l = lens(LensModel::kPinhole);
  l.intrinsics.cx = INFINITY;
  message(l, "principal point");
  message(lens(LensModel::kRadial, {0, std::nan("")}), "distortion coefficient nan");
  message(lens(LensModel::kFov, {3.5}), "omega 3.5");
}

}  // namespace
}  // namespace roxel

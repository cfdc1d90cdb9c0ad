#include "roxel/camera/camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Geometry>

namespace roxel {
namespace {

PinholeCamera skewed_camera() {
  PinholeCamera camera;
  camera.intrinsics = {640, 480, 500, 520, 310, 250, 4};
  camera.pose.rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  camera.pose.centre = {1, -2, 3};
  return camera;
}

TEST(PinholeCamera, ProjectionIsKTimesPointOverDepth) {
  const PinholeCamera camera = skewed_camera();
  const Eigen::Vector3d x(0.3, 0.9, 8);
  const Eigen::Vector3d in_camera = camera.pose.rotation * (x - camera.pose.centre);
  const Eigen::Vector3d k_x = camera.intrinsics.matrix() * in_camera;
  const Eigen::Vector3d p = camera.project(x);
  EXPECT_NEAR(p.x(), k_x.x() / k_x.z(), 1e-10);
  EXPECT_NEAR(p.y(), k_x.y() / k_x.z(), 1e-10);
  EXPECT_DOUBLE_EQ(p.z(), in_camera.z());
}

TEST(PinholeCamera, CentreOfTopLeftPixelIsHalfHalf) {
  // A camera of one pixel by one whose only pixel's centre is the principal point looks straight through it.
  PinholeCamera camera;
  camera.intrinsics = {1, 1, 2, 2, 0.5, 0.5, 0};
  const Ray ray = camera.ray(0.5, 0.5);
  EXPECT_EQ(ray.direction, Eigen::Vector3d(0, 0, 1));
}

RC_GTEST_PROP(PinholeCamera, RayPassesThroughItsPixelAtEveryDepth, (int a, int b, int c)) {
  const PinholeCamera camera = skewed_camera();
  const double u = (a % 10000) * 0.1, v = (b % 10000) * 0.1, depth = 0.01 + std::abs(c % 1000);
  const Ray ray = camera.ray(u, v);
  const Eigen::Vector3d p = camera.project(ray.origin + depth * ray.direction);
  RC_ASSERT(std::abs(p.x() - u) < 1e-7 && std::abs(p.y() - v) < 1e-7);
  RC_ASSERT(std::abs(p.z() - depth) < 1e-9 * (1 + depth));
}

TEST(Intrinsics, NormalisedAndPixelPositionsAreInverse) {
  const Intrinsics k{640, 480, 500, 520, 310, 250, 4};
  const Eigen::Vector2d x(0.25, -0.5);
  const Eigen::Vector2d pixel = pixel_from_normalised(k, x);
  EXPECT_DOUBLE_EQ(pixel.x(), 500 * 0.25 - 4 * 0.5 + 310);
  EXPECT_DOUBLE_EQ(pixel.y(), -520 * 0.5 + 250);
  EXPECT_LT((normalised_from_pixel(k, pixel) - x).norm(), 1e-15);
}

}  // namespace
}  // namespace roxel

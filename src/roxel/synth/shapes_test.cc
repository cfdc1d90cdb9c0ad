#include "roxel/synth/shapes.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

namespace roxel {
namespace {

using Eigen::Vector3f;

TEST(Shapes, DistancesByHand) {
  EXPECT_FLOAT_EQ(sphere_distance({3, 4, 0}, 2), 3);
  EXPECT_FLOAT_EQ(box_distance({4, 5, 0}, {1, 1, 1}), 5);
  EXPECT_FLOAT_EQ(box_distance({0, 0.5f, 0}, {1, 1, 1}), -0.5f);
  EXPECT_FLOAT_EQ(cylinder_distance({3, 4, 1}, 2, 0, 2), 3);
  EXPECT_FLOAT_EQ(cylinder_distance({0, 5, 6}, 2, 0, 2), 5);
  EXPECT_FLOAT_EQ(cylinder_distance({0, 0, 1.5f}, 2, 0, 2), -0.5f);
  EXPECT_FLOAT_EQ(torus_distance({8, 0, 4}, 5, 1), 4);
  EXPECT_FLOAT_EQ(rod_distance({3, 0, 9}, 5, 1), 4);
  EXPECT_FLOAT_EQ(Ellipsoid(2, 2, 2).distance({0, 3, 4}), 3);
}

TEST(Shapes, EllipsoidIsZeroExactlyOnItsSurface) {
  const Ellipsoid ellipsoid(1, 2, 0.5f);
  EXPECT_NEAR(ellipsoid.distance({1, 0, 0}), 0, 1e-6);
  EXPECT_NEAR(ellipsoid.distance({0, 2, 0}), 0, 1e-6);
  EXPECT_NEAR(ellipsoid.distance({0, 0, -0.5f}), 0, 1e-6);
  EXPECT_LT(ellipsoid.distance({0.9f, 0, 0}), 0);
  EXPECT_GT(ellipsoid.distance({1.1f, 0, 0}), 0);
  EXPECT_LT(ellipsoid.distance({0, 0, 0}), 0);
}

TEST(Shapes, SmoothUnionFillsTheSeamOnly) {
  EXPECT_FLOAT_EQ(smooth_union(0.1f, 0.9f, 0.2f), 0.1f);
  EXPECT_FLOAT_EQ(smooth_union(0.1f, 0.1f, 0.2f), 0.05f);
  EXPECT_FLOAT_EQ(smooth_intersection(0.1f, 0.9f, 0.2f), 0.9f);
  EXPECT_FLOAT_EQ(smooth_intersection(-0.1f, -0.1f, 0.2f), -0.05f);
}

// What sphere tracing stands on: no distance grows faster than one walks.
TEST(Shapes, NoDistanceGrowsFasterThanOneWalks) {
  const std::function<float(const Vector3f&)> shapes[] = {
      [](const Vector3f& p) { return sphere_distance(p, 0.7f); },
      [](const Vector3f& p) {
        return box_distance(p, {0.5f, 1, 0.2f});
      },
      [](const Vector3f& p) { return cylinder_distance(p, 0.6f, -0.3f, 1); },
      [](const Vector3f& p) { return torus_distance(p, 1, 0.3f); },
      [](const Vector3f& p) { return rod_distance(p, 1, 0.2f); },
      [](const Vector3f& p) {
        return smooth_union(sphere_distance(p, 0.7f), box_distance(p, {1, 0.2f, 0.2f}), 0.3f);
      }};
  std::mt19937 rng(2);
  std::uniform_real_distribution<float> draw(-2, 2);
  for (int i = 0; i < 3000; ++i) {
    const Vector3f p(draw(rng), draw(rng), draw(rng)), q(draw(rng), draw(rng), draw(rng));
    for (const auto& shape : shapes) EXPECT_LE(std::abs(shape(p) - shape(q)), (p - q).norm() + 1e-5f);
  }
}

}  // namespace
}  // namespace roxel

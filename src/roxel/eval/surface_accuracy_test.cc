#include "roxel/eval/surface_accuracy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "roxel/eval/depth_points.h"

namespace roxel {
namespace {

using Eigen::Vector3d;

/// The square [0, 4] x [0, 4] at height z.
Mesh square(double z) { return {{{0, 0, z}, {4, 0, z}, {4, 4, z}, {0, 4, z}}, {{0, 1, 2}, {0, 2, 3}}}; }

SurfaceAccuracy of_meshes(const Mesh& estimate, const Mesh& truth, const std::vector<double>& distances) {
  const SurfaceSampling sampling{20000, 1, {}};
  return surface_accuracy(SurfaceDistance(truth).of(sample_surface(estimate, sampling), 1),
                          SurfaceDistance(estimate).of(sample_surface(truth, sampling), 1), distances);
}

TEST(SurfaceAccuracy, TruthAgainstItselfIsPerfect) {
  const SurfaceAccuracy same = of_meshes(square(1), square(1), {0.001, 1});
  for (const DistanceShares& shares : same.shares) {
    EXPECT_EQ(shares.precision, 1);
    EXPECT_EQ(shares.recall, 1);
    EXPECT_EQ(shares.f_score, 1);
  }
  EXPECT_NEAR(same.accuracy_90, 0, 1e-12);
}

TEST(SurfaceAccuracy, ADisplacedTruthIsOffByItsDisplacement) {
  const SurfaceAccuracy off = of_meshes(square(1.25), square(1), {0.24, 0.26});
  EXPECT_NEAR(off.accuracy_90, 0.25, 1e-9);
  EXPECT_NEAR(off.mean_to_truth, 0.25, 1e-9);
  EXPECT_NEAR(off.median_to_estimate, 0.25, 1e-9);
  EXPECT_EQ(off.shares[0].f_score, 0);
  EXPECT_EQ(off.shares[1].f_score, 1);
}

TEST(SurfaceAccuracy, HalfASurfaceHasHalfTheRecall) {
  const Mesh half{{{0, 0, 0}, {2, 0, 0}, {2, 4, 0}, {0, 4, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const SurfaceAccuracy accuracy = of_meshes(half, square(0), {0.001});
  EXPECT_EQ(accuracy.shares[0].precision, 1);
  EXPECT_NEAR(accuracy.shares[0].recall, 0.5, 0.015);  // standard error 0.0035
  EXPECT_NEAR(accuracy.shares[0].f_score, 2 * 0.5 / 1.5, 0.015);
}

TEST(SurfaceAccuracy, ByHand) {
  const SurfaceAccuracy accuracy = surface_accuracy({3, 1, 2, 9}, {1, 1, 5}, {1, 2});
  EXPECT_DOUBLE_EQ(accuracy.shares[0].precision, 0.25);
  EXPECT_DOUBLE_EQ(accuracy.shares[0].recall, 2 / 3.0);
  EXPECT_DOUBLE_EQ(accuracy.shares[0].f_score, 2 * 0.25 * (2 / 3.0) / (0.25 + 2 / 3.0));
  EXPECT_DOUBLE_EQ(accuracy.shares[1].precision, 0.5);
  ASSERT_EQ(accuracy.curve.size(), SurfaceAccuracy::kCurveSteps + 1);
  EXPECT_EQ(accuracy.curve.front().precision, 0);
  EXPECT_EQ(accuracy.curve.back().f_score, accuracy.shares.back().f_score);
  EXPECT_EQ(accuracy.accuracy_90, 9);
  EXPECT_EQ(accuracy.median_to_truth, 2);
  EXPECT_DOUBLE_EQ(accuracy.mean_to_estimate, 7 / 3.0);
}

TEST(SurfaceAccuracy, NothingIsInfinitelyFarAndItsSharesAreZero) {
  const SurfaceAccuracy accuracy = surface_accuracy({}, {1}, {2});
  EXPECT_EQ(accuracy.accuracy_90, INFINITY);
  EXPECT_EQ(accuracy.mean_to_truth, INFINITY);
  EXPECT_EQ(accuracy.median_to_truth, INFINITY);
  EXPECT_EQ(accuracy.mean_to_estimate, 1);
  EXPECT_EQ(surface_accuracy({1}, {}, {2}).mean_to_estimate, INFINITY);
  EXPECT_EQ(accuracy.shares[0].precision, 0);
  EXPECT_EQ(accuracy.shares[0].f_score, 0);
}

/// 10 x 10 pixels, looking along +z from the origin.
PinholeCamera ten_pixels() {
  PinholeCamera camera;
  camera.intrinsics = {10, 10, 10, 10, 5, 5, 0};
  return camera;
}

TEST(DepthPoints, AreWherePixelsSayTheyAre) {
  ViewDepth view{ten_pixels(), Image(10, 10, 1, 0.0f)};
  *view.depth.pixel(7, 4) = 4;
  const std::vector<Vector3d> points = depth_points({view}, {}, 1);
  ASSERT_EQ(points.size(), 1);
  EXPECT_NEAR((points[0] - Vector3d(1, -0.2, 4)).norm(), 0, 1e-12);
}

TEST(DepthPoints, CountWhereEnoughViewsAgree) {
  const PinholeCamera camera = ten_pixels();
  ViewDepth a{camera, Image(10, 10, 1, 4.0f)}, b = a, c = a;
  *b.depth.pixel(0, 0) = 4.4f;
  *c.depth.pixel(0, 0) = 0;
  DepthPointOptions options;
  options.views_that_agree = 2;
  options.tolerance = 0.3;
  EXPECT_EQ(depth_points({a, b, c}, options, 1).size(), 3 * 99);
  options.tolerance = 0.5;
  EXPECT_EQ(depth_points({a, b, c}, options, 2).size(), 3 * 99 + 2);
  options.views_that_agree = 3;
  EXPECT_EQ(depth_points({a, b, c}, options, 2).size(), 3 * 99);
}

TEST(DepthPoints, AStrideCountsEveryNthPixelOfRowsAndColumns) {
  const ViewDepth view{ten_pixels(), Image(10, 10, 1, 1.0f)};
  DepthPointOptions options;
  options.stride = 4;
  const std::vector<Vector3d> points = depth_points({view, view}, options, 2);
  ASSERT_EQ(points.size(), 2 * 4);  // rows and columns 2 and 6
  EXPECT_NEAR((points[0] - Vector3d(-0.25, -0.25, 1)).norm(), 0, 1e-12);
  EXPECT_NEAR((points[3] - Vector3d(0.15, 0.15, 1)).norm(), 0, 1e-12);
}

TEST(DepthPoints, TheStrideIsTheSmallestThatKeepsToTheLimit) {
  const std::vector<ViewDepth> views(3, {ten_pixels(), Image(10, 10, 1, 1.0f)});
  EXPECT_EQ(pixel_stride(views, 300), 1);
  EXPECT_EQ(pixel_stride(views, 299), 2);
  EXPECT_EQ(pixel_stride(views, 75), 2);
  EXPECT_EQ(pixel_stride(views, 74), 3);
  for (const std::int64_t most : {300, 100, 74, 40, 11, 3, 1}) {
    DepthPointOptions options;
    options.stride = pixel_stride(views, most);
    EXPECT_LE(std::ssize(depth_points(views, options, 1)), std::max<std::int64_t>(most, 3));
  }
  EXPECT_EQ(pixel_stride({}, 1), 1);
}

}  // namespace
}  // namespace roxel

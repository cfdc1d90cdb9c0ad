#include "roxel/depth/propagate_depth.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <chrono>
#include <cmath>

namespace roxel {
namespace {

constexpr int kSide = 48;

double noise(int i) { return std::sin(12.9898 * i) * 0.5 + std::sin(78.233 * i) * 0.5; }

/// A slope with noise, beside a wall half a unit nearer from `edge` on.
DepthLayers step_scene(int edge, double roughness) {
  DepthLayers layers{Image(kSide, kSide, 1), Image(kSide, kSide, 1, 0.01f), Image(kSide, kSide, 1, 1.0f)};
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      *layers.depth.pixel(x, y) =
          static_cast<float>((x < edge ? 5 + 0.02 * x : 4) + roughness * noise(x + 57 * y));
  return layers;
}

double true_depth(int x, int edge) { return x < edge ? 5 + 0.02 * x : 4; }

class PropagateDepth : public ::testing::Test {
 protected:
  PropagationFigures run(DepthLayers& layers) {
    return propagate_depth(layers, {luma_, 50, 0.05}, options_, [] {});
  }
  static double rms(const Image& depth, int edge, int from, int to) {
    double sum = 0;
    int count = 0;
    for (int y = 4; y < kSide - 4; ++y)
      for (int x = from; x < to; ++x, ++count) sum += std::pow(*depth.pixel(x, y) - true_depth(x, edge), 2);
    return std::sqrt(sum / count);
  }
  Image luma_{kSide, kSide, 1, 0.5f};
  PropagateDepthOptions options_;
};

TEST_F(PropagateDepth, NeighboursTakeNoiseAway) {
  DepthLayers layers = step_scene(kSide, 0.05);
  const PropagationFigures figures = run(layers);
  EXPECT_LT(rms(layers.depth_bp, kSide, 4, kSide - 4), 0.5 * rms(layers.depth, kSide, 4, kSide - 4));
  EXPECT_EQ(figures.pixels, kSide * kSide);
  EXPECT_LT(figures.variance_after, 0.5 * figures.variance_before);
}

TEST_F(PropagateDepth, SaysWhetherBeliefsStillMove) {
  DepthLayers few = step_scene(kSide, 0.05), many = few;
  options_.propagation.sweeps = 5;
  const PropagationFigures moving = run(few);
  EXPECT_EQ(moving.converged, 0);
  EXPECT_GT(moving.movement, options_.propagation.tolerance);
  options_.propagation.sweeps = 2000;
  const PropagationFigures still = run(many);
  EXPECT_EQ(still.converged, 1);
  EXPECT_LT(still.sweeps, 2000);
  EXPECT_LE(still.movement, options_.propagation.tolerance);
}

TEST_F(PropagateDepth, GapsInDepthAreKeptUnlessThePriorIsPlain) {
  DepthLayers aware = step_scene(24, 0.01), plain = aware;
  run(aware);
  options_.prior = DepthPrior::kPlain;
  options_.prior_sigma = 0.05;
  run(plain);
  EXPECT_LT(rms(aware.depth_bp, 24, 22, 26), 0.06);
  EXPECT_GT(rms(plain.depth_bp, 24, 22, 26), 0.1);
}

TEST_F(PropagateDepth, EdgesOfColorWeakenTies) {
  // The right half is hardly known, and 0.02 behind: how far do those on the left pull it?
  DepthLayers one_color{Image(kSide, kSide, 1, 5.0f), Image(kSide, kSide, 1, 1e-4f),
                        Image(kSide, kSide, 1, 1.0f)};
  for (int y = 0; y < kSide; ++y)
    for (int x = 24; x < kSide; ++x)
      *one_color.depth.pixel(x, y) = 5.02f, *one_color.variance.pixel(x, y) = 1;
  DepthLayers two_colors = one_color;
  options_.prior_sigma = 0.2;
  options_.propagation.sweeps = 2000;
  run(one_color);
  for (int y = 0; y < kSide; ++y)
    for (int x = 24; x < kSide; ++x) *luma_.pixel(x, y) = 0.9f;
  run(two_colors);
  EXPECT_GT(*two_colors.depth_bp.pixel(26, 24), *one_color.depth_bp.pixel(26, 24) + 0.003);
}

TEST_F(PropagateDepth, PixelsWithoutDepthAreFilledOnlyWhereAsked) {
  options_.prior_sigma = 0.05;
  DepthLayers layers = step_scene(kSide, 0.01);
  for (int x = 20; x < 25; ++x) *layers.depth.pixel(x, 20) = 0;
  *layers.opacity.pixel(30, 30) = 0.4f;
  EXPECT_EQ(run(layers).filled, 0);
  EXPECT_EQ(*layers.depth_bp.pixel(22, 20), 0);
  EXPECT_EQ(*layers.variance_bp.pixel(22, 20), 0);
  EXPECT_EQ(*layers.depth_bp.pixel(30, 30), 0);
  options_.fill = true;
  EXPECT_EQ(run(layers).filled, 6);
  EXPECT_NEAR(*layers.depth_bp.pixel(22, 20), true_depth(22, kSide), 0.05);
  EXPECT_GT(*layers.variance_bp.pixel(22, 20), *layers.variance_bp.pixel(22, 24));
}

TEST_F(PropagateDepth, NoDepthIsInventedWhereMasksOrTheVolumeCallARayEmpty) {
  options_.prior_sigma = 0.05;
  options_.fill = true;
  DepthLayers layers = step_scene(kSide, 0.01);
  Image fillable(kSide, kSide, 1, 1.0f);
  for (int x = 20; x < 25; ++x) *layers.opacity.pixel(x, 20) = 0.3f;
  *fillable.pixel(22, 20) = 0;
  *layers.opacity.pixel(23, 20) = 0.01f;
  DepthLayers unmasked = layers;
  EXPECT_EQ(propagate_depth(layers, {luma_, 50, 0.05, fillable}, options_, [] {}).filled, 4);
  EXPECT_EQ(*layers.depth_bp.pixel(22, 20), 0);
  EXPECT_NEAR(*layers.depth_bp.pixel(23, 20), true_depth(23, kSide), 0.05);
  EXPECT_EQ(run(unmasked).filled, 4);
  EXPECT_EQ(*unmasked.depth_bp.pixel(23, 20), 0);
  EXPECT_NEAR(*unmasked.depth_bp.pixel(22, 20), true_depth(22, kSide), 0.05);
}

TEST_F(PropagateDepth, ThePriorsDeviationIsFoundInTheData) {
  DepthLayers smooth = step_scene(kSide, 0.01), rough = step_scene(kSide, 0.08);
  const double a = run(smooth).prior_sigma, b = run(rough).prior_sigma;
  EXPECT_GT(b, 4 * a);
  options_.prior_sigma = 0.123;
  EXPECT_EQ(run(rough).prior_sigma, 0.123);
}

TEST(PixelPlane, NormalAndSlopesSayTheSame) {
  PinholeCamera camera;
  camera.intrinsics = {64, 48, 60, 70, 30, 25, 2};
  camera.pose.rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  camera.pose.centre = {1, -2, 0.5};
  const Eigen::Vector3d normal =
      (camera.pose.rotation.transpose() * Eigen::Vector3d(0.3, -0.2, -1)).normalized();
  const PixelPlane plane = plane_of_normal(camera, 0.25, normal, 20.5, 30.5);
  EXPECT_LT((world_normal(camera, plane, 20.5, 30.5) - normal).norm(), 1e-6);
  // Points of the plane seen by other pixels lie on it.
  const auto point = [&](double u, double v) {
    const Ray ray = camera.ray(u, v);
    return Eigen::Vector3d(
        ray.origin + ray.direction / plane.at(static_cast<float>(u - 20.5), static_cast<float>(v - 30.5)));
  };
  EXPECT_NEAR(normal.dot(point(25.5, 22.5) - point(20.5, 30.5)), 0, 1e-5);
}

}  // namespace
}  // namespace roxel

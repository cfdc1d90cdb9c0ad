#include "roxel/march/sample_plan.h"

#include <gtest/gtest.h>

#include <cmath>

namespace roxel {
namespace {

constexpr double kFocal = 400;
constexpr double kVoxel = 0.02;

double diagonal_px(int level) { return std::sqrt(2.0) * std::ldexp(1.0, level); }

PinholeCamera camera_at(double z) {
  PinholeCamera camera;
  camera.intrinsics = {640, 480, kFocal, kFocal, 320, 240, 0};
  camera.pose.centre = {0, 0, z};
  return camera;
}

/// A box of depths 0.5 to 8 before a camera at the origin.
const Eigen::AlignedBox3d kBox(Eigen::Vector3d(-1, -1, 0.5), Eigen::Vector3d(1, 1, 8));

SamplePlan plan_with(double samples_per_voxel, bool adaptive = true, Stretch range = {0.1, 20}) {
  SamplePlanOptions options;
  options.samples_per_voxel = samples_per_voxel;
  options.adaptive = adaptive;
  options.max_root_level = 30;
  return make_sample_plan(camera_at(0), kBox, kVoxel, range, options);
}

TEST(SamplePlan, ASampleServesDepthsUpToVoxelTimesFocalOverDiagonal) {
  for (const double m : {0.25, 0.5}) {
    const SamplePlan plan = plan_with(m);
    ASSERT_GT(plan.root_level, plan.finest_level);
    for (int level = plan.finest_level + 1; level <= plan.root_level; ++level)
      EXPECT_NEAR(plan.serves_until(level), kVoxel * kFocal / (diagonal_px(level) * m), 1e-12);
  }
}

TEST(SamplePlan, TheFinestSamplesServeAllTheRest) {
  const SamplePlan plan = plan_with(0.25);
  EXPECT_EQ(plan.serves_until(plan.finest_level), std::numeric_limits<double>::infinity());
}

// L = f s / (D m): the finest level is the coarsest whose diagonal is not above it.
TEST(SamplePlan, TheLimitingSampleSizeIsThatOfTheFarEnd) {
  for (const double m : {0.03, 0.06, 0.1}) {
    const double limit = kFocal * kVoxel / (8 * m);
    const SamplePlan plan = plan_with(m);
    EXPECT_LE(diagonal_px(plan.finest_level), limit) << m;
    EXPECT_GT(diagonal_px(plan.finest_level + 1), limit) << m;
  }
}

TEST(SamplePlan, TheFarDistanceOfRaysLimitsTheSampleSize) {
  const double m = 0.06;
  const SamplePlan near = plan_with(m, true, {0.1, 2});
  EXPECT_LE(diagonal_px(near.finest_level), kFocal * kVoxel / (2 * m));
  EXPECT_GT(diagonal_px(near.finest_level + 1), kFocal * kVoxel / (2 * m));
}

TEST(SamplePlan, NeverFinerThanAPixel) {
  const SamplePlan plan = plan_with(16);
  EXPECT_EQ(plan.finest_level, 0);
  EXPECT_EQ(plan.root_level, 0);
}

TEST(SamplePlan, WithoutAdaptivityTheLimitingSizeServesEveryDepth) {
  const SamplePlan adaptive = plan_with(0.06), fixed = plan_with(0.06, false);
  EXPECT_EQ(fixed.finest_level, adaptive.finest_level);
  EXPECT_EQ(fixed.root_level, fixed.finest_level);
  EXPECT_GT(adaptive.root_level, fixed.root_level);
}

TEST(SamplePlan, TwiceTheSamplesPerVoxelHalveTheSamples) {
  const SamplePlan coarse = plan_with(0.05), fine = plan_with(0.1);
  EXPECT_EQ(fine.root_level, coarse.root_level - 1);
  EXPECT_EQ(fine.finest_level, coarse.finest_level - 1);
}

// At each depth between the box's nearest and farthest point: no sample wider than s / m, and its parent
// would be.
TEST(SamplePlan, EveryDepthIsServedByTheCoarsestSampleThatIsFineEnough) {
  const double m = 0.06;
  const SamplePlan plan = plan_with(m);
  for (double z = 0.55; z < 8; z *= 1.07) {
    int level = plan.root_level;
    while (z > plan.serves_until(level)) --level;
    EXPECT_LE(diagonal_px(level) * z / kFocal, kVoxel / m * (1 + 1e-9)) << z;
    EXPECT_GT(diagonal_px(level + 1) * z / kFocal, kVoxel / m) << z;
  }
}

TEST(SamplePlan, RootsStayBelowTheirLimit) {
  SamplePlanOptions options;
  options.samples_per_voxel = 0.001;
  options.max_root_level = 4;
  const SamplePlan plan = make_sample_plan(camera_at(0), kBox, kVoxel, {0.1, 20}, options);
  EXPECT_EQ(plan.root_level, 4);
  EXPECT_LE(plan.finest_level, 4);
}

TEST(SamplePlan, ACameraInTheBoxHasRootsAsLargeAsTheyMayBe) {
  SamplePlanOptions options;
  const SamplePlan plan = make_sample_plan(camera_at(2), kBox, kVoxel, {1e-6, 20}, options);
  EXPECT_EQ(plan.root_level, options.max_root_level);
}

TEST(SamplePlan, CoarserServesEveryDepthWithSamplesOfTwiceTheWidth) {
  SamplePlan plan;
  plan.finest_level = 1;
  plan.root_level = 3;
  plan.range = {0.5, 20};
  plan.serves_until_ = {0, 8, 4, 2};
  const SamplePlan coarser = plan.coarser();
  EXPECT_EQ(coarser.finest_level, 2);
  EXPECT_EQ(coarser.root_level, 4);
  EXPECT_EQ(coarser.range.begin, 0.5);
  EXPECT_EQ(coarser.range.end, 20);
  for (int level = 1; level <= 3; ++level)
    EXPECT_EQ(coarser.serves_until(level + 1), plan.serves_until(level));
}

TEST(SamplePlan, TheLastLevelServesAsFarAsTheRangeGoes) {
  SamplePlan plan;
  plan.finest_level = 1;
  plan.root_level = 3;
  plan.serves_until_ = {0, 8, 4, 2};
  const int last_level_to[][2] = {{1, 3}, {2, 3}, {3, 2}, {4, 2}, {5, 1}, {20, 1}};
  for (const auto& [far, last] : last_level_to) {
    plan.range = {0.5, static_cast<double>(far)};
    EXPECT_EQ(plan.last_level(), last) << far;
  }
}

}  // namespace
}  // namespace roxel

#include "roxel/depth/depth_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "roxel/base/error.h"
#include "roxel/infer/infer_fixture.h"

namespace roxel {
namespace {

using fixture::camera_at;
using fixture::plain_image;
using fixture::plan_of;
using fixture::view_of;

constexpr double kVoxel = 0.1;
constexpr float kColor[3] = {60, 20, -10};
constexpr float kOther[3] = {20, -30, 40};

/// Sheets of voxels at right angles to z, seen by a small camera at the origin that looks along z.
class Sheets : public ::testing::Test {
 protected:
  /// One sheet at each index k in z, of opacity alpha over one voxel length.
  void build(const std::vector<std::pair<int, double>>& sheets) {
    Topology topology(LatticeFrame{{-0.8, -0.8, 1}, kVoxel, {2, 2, 2}});
    for (const auto& [k, alpha] : sheets)
      for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) topology.insert({x, y, k});
    volume_ = Volume({topology});
    for (const auto& [k, alpha] : sheets)
      for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x)
          volume_.tau[fixture::slot_at(volume_, x, y, k)] = tau_from_alpha(static_cast<float>(alpha));
    pass_.predictive = false;
    pass_.opacity.model.evidence_half = 0;
  }
  static double middle(int k) { return 1 + kVoxel * (k + 0.5); }

  static PinholeCamera small_camera() {
    PinholeCamera camera;
    camera.intrinsics = {8, 8, 40, 40, 4, 4, 0};
    return camera;
  }

  DepthMap estimate(const DepthOptions& options, const float color[3] = kColor, const Mask& foreground = {}) {
    const LatticeStack stack(volume_);
    NodeScratch scratch(stack, volume_.tau);
    Totals totals(volume_.slot_count());
    for (ColorTotals& t : totals.color) {
      const double m[3] = {kColor[0], kColor[1], kColor[2]};
      const double moments[10] = {1,           m[0],        m[1],        m[2],        m[0] * m[0],
                                  m[1] * m[1], m[2] * m[2], m[0] * m[1], m[0] * m[2], m[1] * m[2]};
      for (int c = 0; c < 10; ++c) t[c] = std::llrint(moments[c] * kColorUnit);
    }
    const SampleNode node{view_of(small_camera(), plain_image(8, {color[0], color[1], color[2]}),
                                  plan_of({0.5, 5}, 0), {}, foreground)};
    scratch.compare_with(totals.color);
    return estimate_depth(stack, node, pass_, options, RunContext(1), scratch).front();
  }

  Volume volume_;
  PassOptions pass_;
};

TEST_F(Sheets, AnOpaqueSheetIsFoundWithinHalfAVoxel) {
  build({{7, 0.9999}});
  for (const DepthEstimate estimate_by :
       {DepthEstimate::kMean, DepthEstimate::kMedian, DepthEstimate::kMainMode}) {
    const DepthMap map = estimate({estimate_by, DepthWeight::kPosterior});
    for (int i = 0; i < 64; ++i) {
      EXPECT_NEAR(map.depth.data()[i], middle(7), 0.5 * kVoxel);
      EXPECT_NEAR(map.opacity.data()[i], 1, 1e-3);
      // s^2 / 12 for the voxel's extent, and at most as much again for where in its chord a ray ends. Along a
      // slanted ray a voxel is shorter in depth.
      const double cosine = 1 / std::sqrt(1 + 2 * std::pow(3.5 / 40, 2));
      EXPECT_GE(map.variance.data()[i], 0.99 * cosine * cosine * kVoxel * kVoxel / 12);
      EXPECT_LE(map.variance.data()[i], 1.01 * kVoxel * kVoxel / 6);
    }
  }
}

TEST_F(Sheets, RaysEndWhereTheyEndOnAverageInTheirChord) {
  // Through the middle pixel's neighbour nearly along z: chord of one voxel. tau -> 0 ends in the middle, tau
  // = 5 after 1/5 - exp(-5)/(1 - exp(-5)) of it.
  build({{7, 0.01}});
  EXPECT_NEAR(*estimate({DepthEstimate::kMean, DepthWeight::kPrior}).depth.pixel(4, 4), 0,
              0);  // too faint: no depth
  build({{7, 0.1}});
  const double tau = -std::log(0.9), e = 1 / tau - 0.9 / 0.1;
  EXPECT_NEAR(*estimate({DepthEstimate::kMean, DepthWeight::kPosterior}).depth.pixel(4, 4),
              1 + kVoxel * (7 + e), 1e-4);
  build({{7, 1 - std::exp(-5)}});
  EXPECT_NEAR(*estimate({DepthEstimate::kMean, DepthWeight::kPosterior}).depth.pixel(4, 4),
              1 + kVoxel * (7 + 0.2 - std::exp(-5) / (1 - std::exp(-5))), 2e-3);
}

TEST_F(Sheets, TwoSurfacesAreTwoModes) {
  build({{2, 0.35}, {12, 0.999}});
  // Equal agreement: responsibilities 0.35 and nearly 0.65.
  const DepthMap mean = estimate({DepthEstimate::kMean, DepthWeight::kPosterior});
  const DepthMap mode = estimate({DepthEstimate::kMainMode, DepthWeight::kPosterior});
  const DepthMap median = estimate({DepthEstimate::kMedian, DepthWeight::kPosterior});
  const double gap = middle(12) - middle(2);
  for (int i = 0; i < 64; ++i) {
    EXPECT_NEAR(mean.depth.data()[i], 0.35 * middle(2) + 0.65 * middle(12), 0.5 * kVoxel);
    EXPECT_NEAR(mode.depth.data()[i], middle(12), 0.5 * kVoxel);
    EXPECT_NEAR(median.depth.data()[i], middle(12), 0.5 * kVoxel);
    // Two places: w1 w2 gap^2 about their mean, w1 gap^2 about the second.
    EXPECT_NEAR(mean.variance.data()[i], 0.35 * 0.65 * gap * gap, 0.05 * gap * gap);
    EXPECT_NEAR(mode.variance.data()[i], 0.35 * gap * gap, 0.05 * gap * gap);
    EXPECT_NEAR(median.variance.data()[i], 0.35 * gap * gap, 0.05 * gap * gap);
  }
}

TEST_F(Sheets, TheThesisCountsOpacityTwice) {
  build({{2, 0.35}, {12, 0.999}});
  const DepthMap once = estimate({DepthEstimate::kMean, DepthWeight::kPosterior});
  const DepthMap twice = estimate({DepthEstimate::kMean, DepthWeight::kTimesOpacity});
  const double near = 0.35 * 0.35, far = 0.65 * 0.999;
  const double expected = (near * middle(2) + far * middle(12)) / (near + far);
  for (int i = 0; i < 64; ++i) {
    EXPECT_NEAR(twice.depth.data()[i], expected, 0.5 * kVoxel);
    EXPECT_LT(twice.variance.data()[i], 0.65 * once.variance.data()[i]);
    EXPECT_EQ(twice.opacity.data()[i], once.opacity.data()[i]);
  }
}

TEST_F(Sheets, TheNearerSurfaceWinsWhereItHasMore) {
  build({{2, 0.7}, {12, 0.999}});
  const DepthMap mode = estimate({DepthEstimate::kMainMode, DepthWeight::kPosterior});
  for (int i = 0; i < 64; ++i) EXPECT_NEAR(mode.depth.data()[i], middle(2), 0.5 * kVoxel);
}

TEST_F(Sheets, OpacityIsThePosteriorThatTheRayEndsInTheBox) {
  build({{7, 0.3}});
  pass_.opacity.background.unknown_likelihood = 0.05f;
  const double a = 0.3,
               z = a * 1 + (1 - a) * 0.05;  // the middle pixel's chord is a voxel long to 1 part in 300
  EXPECT_NEAR(*estimate({DepthEstimate::kMean, DepthWeight::kPosterior}).opacity.pixel(4, 4), a / z, 2e-3);
  EXPECT_NEAR(*estimate({DepthEstimate::kMean, DepthWeight::kPrior}).opacity.pixel(4, 4), a, 2e-3);
}

TEST_F(Sheets, WhatDisagreesIsNotSeen) {
  build({{7, 0.6}});
  pass_.opacity.background.unknown_likelihood = 0.001f;
  const DepthMap map = estimate({DepthEstimate::kMainMode, DepthWeight::kPosterior}, kOther);
  for (int i = 0; i < 64; ++i) {
    EXPECT_EQ(map.depth.data()[i], 0);
    EXPECT_EQ(map.variance.data()[i], 0);
    EXPECT_LT(map.opacity.data()[i], DepthMap::kLeastOpacity);
  }
  // Without looking at the image it is.
  const DepthMap blind = estimate({DepthEstimate::kMainMode, DepthWeight::kPrior}, kOther);
  for (int i = 0; i < 64; ++i) EXPECT_NEAR(blind.depth.data()[i], middle(7), 0.5 * kVoxel);
}

TEST_F(Sheets, SurroundIsNoDepth) {
  Topology box(LatticeFrame{{-0.8, -0.8, 1}, kVoxel, {4, 4, 4}});
  Topology around(LatticeFrame{{-2.4, -2.4, -0.6}, 2 * kVoxel, {4, 4, 4}});
  box.insert({0, 0, 0});  // off every ray
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) around.insert({x, y, 30});  // behind the box
  volume_ = Volume({box, around});
  std::fill(volume_.tau.begin(), volume_.tau.end(), 10.0f);
  const DepthMap map = estimate({});
  for (int i = 0; i < 64; ++i) {
    EXPECT_EQ(map.depth.data()[i], 0);
    EXPECT_EQ(map.opacity.data()[i], 0);
  }
}

TEST_F(Sheets, PredictionLeavesTheNodesOwnColoursOut) {
  build({{7, 0.6}});
  pass_.predictive = true;
  pass_.opacity.model.evidence_half = 0.2f;
  // The totals are exactly what this node itself says: nothing is left, so the likelihood is p_0, like that
  // of the unknown background, and the posterior is the prior.
  const LatticeStack stack(volume_);
  NodeScratch scratch(stack, volume_.tau);
  const SampleNode node{
      view_of(small_camera(), plain_image(8, {kColor[0], kColor[1], kColor[2]}), plan_of({0.5, 5}, 0))};
  const std::vector<SampleNode> nodes{node};
  const RunContext context(1);
  CollectedColors collected(volume_.slot_count(), 1, 0);
  collect_color(stack, nodes, pass_, context, nullptr, collected);
  compare_with_others(stack, nodes[0], 0, pass_, collected, context, scratch);
  const DepthMap alone = estimate_depth(stack, node, pass_, {}, context, scratch).front();
  EXPECT_NEAR(*alone.opacity.pixel(4, 4), 0.6, 5e-3);
  pass_.predictive = false;
  scratch.reset();
  compare_with_others(stack, nodes[0], 0, pass_, collected, context, scratch);
  const DepthMap fooled = estimate_depth(stack, node, pass_, {}, context, scratch).front();
  EXPECT_GT(*fooled.opacity.pixel(4, 4), 0.99);
}

TEST_F(Sheets, AMaskedPixelIsObjectWhereMostOfItIs) {
  build({{7, 0.6}});
  pass_.opacity.background.kind = BackgroundKind::kMask;
  const DepthMap mostly = estimate({}, kColor, Mask(8, 8, 200));
  const DepthMap hardly = estimate({}, kColor, Mask(8, 8, 100));
  for (int i = 0; i < 64; ++i) {
    EXPECT_NEAR(mostly.depth.data()[i], middle(7), 0.5 * kVoxel);
    EXPECT_NEAR(mostly.opacity.data()[i], 1, 1e-3);
    EXPECT_EQ(hardly.depth.data()[i], 0);
  }
}

TEST_F(Sheets, StopsWhenCancelled) {
  build({{7, 0.6}});
  const LatticeStack stack(volume_);
  NodeScratch scratch(stack, volume_.tau);
  RunContext context(1);
  context.cancel();
  const SampleNode node{view_of(small_camera(), plain_image(8, {50, 0, 0}), plan_of({0.5, 5}, 0))};
  EXPECT_THROW(estimate_depth(stack, node, pass_, {}, context, scratch), Cancelled);
}

}  // namespace
}  // namespace roxel

// Worlds that can be computed by hand.
#include <gtest/gtest.h>

#include "roxel/infer/infer_fixture.h"

namespace roxel {
namespace {

using fixture::camera_at;
using fixture::plain_image;
using fixture::plan_of;
using fixture::view_of;

constexpr float kBackground[3] = {5, 0, 0};
constexpr float kObject[3] = {60, 40, 30};

/// No prior, no prediction, and a background that no colour resembles.
PassOptions bare_options() {
  PassOptions options;
  options.prior.strength = 0;
  options.prior.spatial_lambda = 0;
  options.predictive = false;
  options.opacity.model.evidence_half = 0;
  options.opacity.background.kind = BackgroundKind::kKnown;
  std::copy(kBackground, kBackground + 3, options.opacity.background.mean);
  return options;
}

Volume full_brick(float tau) {
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {1, 1, 1}});
  for (int v = 0; v < kBrickVoxels; ++v) topology.insert({v % 8, v / 8 % 8, v / 64});
  Volume volume({topology});
  std::fill(volume.tau.begin(), volume.tau.end(), tau);
  return volume;
}

/// What a camera sees of one opaque voxel before the background: pixels whose centre ray meets it.
SampleNode photograph_of_voxel(const PinholeCamera& camera, const Eigen::Vector3i& voxel, bool empty) {
  const Eigen::Vector3d corner = voxel.cast<double>();
  const Eigen::AlignedBox3d cell(corner, corner + Eigen::Vector3d::Ones());
  const int size = camera.intrinsics.width;
  Image image(size, size, 3);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const Stretch hit = clip_to_box(camera.ray(x + 0.5, y + 0.5), cell, {0, 100});
      const float* color = hit.end > hit.begin && !empty ? kObject : kBackground;
      std::copy(color, color + 3, image.pixel(x, y));
    }
  return {view_of(camera, image, plan_of({1, 100}, 0))};
}

std::vector<SampleNode> two_photographs(const Eigen::Vector3i& voxel, bool empty = false) {
  const Eigen::Vector3d centre = voxel.cast<double>() + Eigen::Vector3d::Constant(0.5);
  std::vector<SampleNode> nodes;
  for (const Eigen::Vector3d& from : {Eigen::Vector3d(-20, 3.1, 5.2), Eigen::Vector3d(4.4, 2.3, 30)})
    nodes.push_back(photograph_of_voxel(camera_at(from, centre, 96, 140), voxel, empty));
  return nodes;
}

TEST(RunPass, OneOpaqueVoxelSeenTwiceIsFoundExactly) {
  const Eigen::Vector3i voxel(3, 4, 4);
  Volume volume = full_brick(0.05f);
  const std::vector<SampleNode> nodes = two_photographs(voxel);
  PassOptions options = bare_options();
  for (int pass = 0; pass < 150; ++pass) {
    options.everywhere = pass == 0;
    run_pass(nodes, options, RunContext(1), nullptr, volume);
  }
  const std::uint32_t slot = fixture::slot_at(volume, 3, 4, 4);
  EXPECT_NEAR(alpha_from_tau(volume.tau[slot]), 1, 1e-3);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(volume.color_mean[slot][c], kObject[c], 1e-3);
  for (int c = 0; c < 6; ++c) EXPECT_NEAR(volume.color_cov[slot].unpacked()[c], 0, 1e-2);
  // What rays of both cameras cross stands before or behind it; only its silhouette's edge may keep a little.
  int others = 0;
  for (std::uint32_t s = 0; s < volume.slot_count(); ++s)
    if (s != slot && volume.confidence[s] > 0.3f && alpha_from_tau(volume.tau[s]) > 1e-3) ++others;
  EXPECT_EQ(others, 0);
}

TEST(RunPass, AnEmptySceneIsFoundEmpty) {
  Volume volume = full_brick(0.05f);
  const std::vector<SampleNode> nodes = two_photographs({3, 4, 4}, true);
  PassOptions options = bare_options();
  for (int pass = 0; pass < 5; ++pass) {
    options.everywhere = pass == 0;
    run_pass(nodes, options, RunContext(1), nullptr, volume);
  }
  int seen = 0;
  for (std::uint32_t slot = 0; slot < volume.slot_count(); ++slot) {
    if (volume.confidence[slot] == 0) continue;  // no ray met it: without a prior it keeps alpha_0
    ++seen;
    ASSERT_NEAR(alpha_from_tau(volume.tau[slot]), 0, 1e-3);
  }
  EXPECT_GT(seen, 400);
}

// An empty scene under the prior rests where tau (exposure + beta) = beta tau_0, exposure being all chords.
TEST(RunPass, AnEmptySceneUnderThePriorHasItsClosedForm) {
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {1, 1, 1}});
  topology.insert({4, 4, 4});
  Volume volume({topology});
  volume.tau[0] = 0.05f;
  const PinholeCamera camera = camera_at({4.5, 4.5, -20}, {4.5, 4.5, 4.5}, 1, 10);
  SampleView view =
      view_of(camera, plain_image(1, {kBackground[0], kBackground[1], kBackground[2]}), plan_of({1, 100}, 0));
  view.pixel_weight = 3;
  PassOptions options = bare_options();
  options.prior.strength = 5;
  options.prior.opacity = 0.02;
  for (int pass = 0; pass < 5; ++pass) run_pass({{view}}, options, RunContext(1), nullptr, volume);
  const double tau_0 = -std::log(0.98);
  EXPECT_NEAR(volume.tau[0], 5 * tau_0 / (3 * 1.0 + 5), 1e-6);  // one chord of length 1, weight 3
}

/// One voxel in front of a background, one ray through its middle.
TEST(RunPass, OneRayThroughOneVoxelHasItsClosedForm) {
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {1, 1, 1}});
  topology.insert({4, 4, 4});
  Volume volume({topology});
  const double tau = 0.7, weight = 2, beta = 1.5, alpha_0 = 0.1, p_bg = 0.03;
  volume.tau[0] = static_cast<float>(tau);
  const PinholeCamera camera = camera_at({4.5, 4.5, -20}, {4.5, 4.5, 4.5}, 1, 10);
  SampleView view = view_of(camera, plain_image(1, {50, 10, 10}), plan_of({1, 100}, 0));
  view.pixel_weight = static_cast<float>(weight);
  PassOptions options = bare_options();
  options.opacity.background.kind = BackgroundKind::kUnknown;
  options.opacity.background.unknown_likelihood = static_cast<float>(p_bg);
  options.prior.strength = beta;
  options.prior.opacity = alpha_0;
  const PassReport report = run_pass({{view}}, options, RunContext(1), nullptr, volume);

  // Its own colour without spread: agreement 1.
  const double a = 1 - std::exp(-tau), z = a + (1 - a) * p_bg, r = a / z;
  const double e = 1 / tau - (1 - a) / a;
  const double hits = weight * r, exposure = weight * ((1 - r) * 1 + r * e);
  // The colour's variance is a difference of moments of 50^2, right to 1e-7 of that: 2e-5 of the agreement.
  EXPECT_NEAR(volume.tau[0], (hits + beta * -std::log(1 - alpha_0)) / (exposure + beta), 1e-5);
  EXPECT_NEAR(volume.support[0][0], hits, 1e-5);
  EXPECT_NEAR(volume.support[0][1], exposure, 1e-5);
  EXPECT_NEAR(volume.confidence[0], 1.0 / 3, 1e-6);  // one node that looked with all its weight: n = 1
  EXPECT_NEAR(report.opacity.log_likelihood, weight * std::log(z), 1e-4);
  EXPECT_EQ(report.opacity.rays, 1);
  EXPECT_EQ(report.opacity.steps, 1);
}

/// Totals of one colour without spread, of weight 1.
ColorTotals plain_totals(const std::array<float, 3>& m) {
  ColorTotals totals{};
  const double moments[10] = {1,           m[0],        m[1],        m[2],        m[0] * m[0],
                              m[1] * m[1], m[2] * m[2], m[0] * m[1], m[0] * m[2], m[1] * m[2]};
  for (int c = 0; c < 10; ++c) totals[c] = std::llrint(moments[c] * kColorUnit);
  return totals;
}

/// Voxels (2, 4, 4), (4, 4, 4), (5, 4, 4) whose colours agree with the sample by 0.5, 1 and 0.25.
struct ThreeVoxelRay {
  Volume volume;
  std::vector<ColorTotals> totals;
  MarchOptions options;

  ThreeVoxelRay() {
    Topology topology(LatticeFrame{{0, 0, 0}, 1, {1, 1, 1}});
    for (const int x : {2, 4, 5}) topology.insert({x, 4, 4});
    volume = Volume({topology});
    std::fill(volume.tau.begin(), volume.tau.end(), 0.3f);
    options.rule = UpdateRule::kRoxels;
    options.model.agreement = Agreement::kLinear;
    options.model.scale = 40;
    options.model.evidence_half = 0;
    options.model.outlier = 0;
    options.background.kind = BackgroundKind::kUnknown;
    options.background.unknown_likelihood = 0.25f;
    for (const float distance : {20.0f, 0.0f, 30.0f}) totals.push_back(plain_totals({50 + distance, 0, 0}));
  }

  void march(const SampleNode& node, Totals& sums) {
    const LatticeStack stack(volume);
    NodeScratch scratch(stack, volume.tau);
    scratch.compare_with(totals);
    march_opacity(stack, node, options, RunContext(1), scratch);
    sums.add_opacity(stack, scratch);
  }
};

SampleView along_x(const std::array<float, 3>& color, float weight) {
  const PinholeCamera camera = camera_at({-20, 4.5, 4.5}, {4.5, 4.5, 4.5}, 1, 10);
  SampleView view = view_of(camera, plain_image(1, color), plan_of({1, 100}, 0));
  view.pixel_weight = weight;
  return view;
}

TEST(RoxelsRule, ThreeVoxelsByHand) {
  ThreeVoxelRay ray;
  Totals sums(3);
  ray.march({along_x({50, 0, 0}, 1)}, sums);
  // Agreements 1/2, 1, 1/4 and background 1/4 sum to 2.
  const double r[3] = {0.25, 0.5, 0.125};
  const double alpha[3] = {0.25, 0.5 / 0.75, 0.125 / 0.25};
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(sums.opacity[i][0] / kOpacityUnit, r[i], 2e-6);
    EXPECT_NEAR(sums.opacity[i][1] / kOpacityUnit, r[i] * alpha[i], 2e-6);
  }
  update_opacity(UpdateRule::kRoxels, sums, {0.02f, 0.02f, 0.02f}, 5, 1, ray.volume);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(alpha_from_tau(ray.volume.tau[i]), alpha[i], 1e-5);
}

TEST(RoxelsRule, RaysAverageByResponsibility) {
  ThreeVoxelRay ray;
  Totals sums(3);
  ray.march({along_x({50, 0, 0}, 1), along_x({70, 0, 0}, 2)}, sums);
  // The second ray, of weight 2, agrees by 1, 1/2, 3/4: with the background 2.5.
  const double first_r = 0.25, first_alpha = 0.25, second_r = 1 / 2.5, second_alpha = 1 / 2.5;
  const double expected = (first_r * first_alpha + 2 * second_r * second_alpha) / (first_r + 2 * second_r);
  update_opacity(UpdateRule::kRoxels, sums, {0.02f, 0.02f, 0.02f}, 5, 1, ray.volume);
  EXPECT_NEAR(alpha_from_tau(ray.volume.tau[0]), expected, 1e-5);
}

TEST(RoxelsRule, WithoutABackgroundTheLastVoxelIsOpaque) {
  ThreeVoxelRay ray;
  ray.options.background.kind = BackgroundKind::kNone;
  Totals sums(3);
  ray.march({along_x({50, 0, 0}, 1)}, sums);
  update_opacity(UpdateRule::kRoxels, sums, {0.02f, 0.02f, 0.02f}, 5, 1, ray.volume);
  EXPECT_NEAR(alpha_from_tau(ray.volume.tau[2]), 1, 1e-4);
}

TEST(ColorPass, DepositsResponsibilityTimesRayWeightTimesObservation) {
  ThreeVoxelRay ray;
  const LatticeStack stack(ray.volume);
  NodeScratch scratch(stack, ray.volume.tau);
  const SampleNode node{along_x({50, 8, -3}, 0.4f)};
  march_color(stack, node, ray.options, false, RunContext(1), scratch);
  const double a = 1 - std::exp(-0.3);
  for (int i = 0; i < 3; ++i) {
    const double w = 0.4 * a * std::pow(1 - a, i);
    EXPECT_NEAR(scratch[i].evidence, w, 1e-6);
    EXPECT_NEAR(scratch[i].mean[0], 50 * w, 50e-6);
    EXPECT_NEAR(scratch[i].cov[5], 8 * -3 * w, 50e-6);
  }
  scratch.reset();
  march_color(stack, node, ray.options, true, RunContext(1), scratch);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(scratch[i].evidence, 0.4, 1e-6);
}

TEST(ColorPass, SamplesOfAKnownBackgroundColourNothing) {
  ThreeVoxelRay ray;
  ray.options.background.kind = BackgroundKind::kKnown;
  ray.options.background.mean[0] = 50;
  const LatticeStack stack(ray.volume);
  NodeScratch scratch(stack, ray.volume.tau);
  ray.options.model.agreement = Agreement::kGaussian;
  march_color(stack, {along_x({50, 0, 0}, 1)}, ray.options, true, RunContext(1), scratch);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(scratch[i].evidence, 0, 1e-6);
}

// Two nodes see one voxel: each is compared with what the other saw.
TEST(RunPass, PredictionComparesWithTheOtherNode) {
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {1, 1, 1}});
  topology.insert({4, 4, 4});
  const std::array<float, 3> red{50, 60, 0}, dark{20, 0, 0};
  const auto node = [](const Eigen::Vector3d& from, const std::array<float, 3>& color) {
    return SampleNode{
        view_of(camera_at(from, {4.5, 4.5, 4.5}, 1, 10), plain_image(1, color), plan_of({1, 100}, 0))};
  };
  const auto log_likelihood = [&](const std::array<float, 3>& second, bool predictive) {
    Volume volume({topology});
    volume.tau[0] = 0.5f;
    PassOptions options;
    options.predictive = predictive;
    options.everywhere = true;
    options.opacity.model.evidence_half = 0.2f;
    options.opacity.model.uninformative = 0.001f;
    options.opacity.background.kind = BackgroundKind::kNone;
    const std::vector<SampleNode> nodes{node({4.5, 4.5, -20}, red), node({-20, 4.5, 4.5}, second)};
    return run_pass(nodes, options, RunContext(1), nullptr, volume).opacity.log_likelihood;
  };
  const double a = 1 - std::exp(-0.5), w_0 = 0.2, p_0 = 0.001;
  const double agreeing = (1 + w_0 * p_0) / (1 + w_0);  // weight 1 of the other node, agreement 1
  EXPECT_NEAR(log_likelihood(red, true), 2 * std::log(a * agreeing), 1e-4);
  EXPECT_NEAR(log_likelihood(dark, true), 2 * std::log(a * w_0 * p_0 / (1 + w_0)), 1e-2);
  // Compared with the mixture of both, which has their spread, each agrees a little.
  EXPECT_GT(log_likelihood(dark, false), log_likelihood(dark, true) + 5);
}

TEST(RunPass, OneNodeAloneHasNoEvidenceToBeComparedWith) {
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {1, 1, 1}});
  topology.insert({4, 4, 4});
  Volume volume({topology});
  volume.tau[0] = 0.5f;
  PassOptions options;
  options.everywhere = true;
  options.opacity.model.uninformative = 0.001f;
  options.opacity.background.kind = BackgroundKind::kNone;
  const PassReport report = run_pass({{along_x({50, 0, 0}, 1)}}, options, RunContext(1), nullptr, volume);
  EXPECT_NEAR(report.opacity.log_likelihood, std::log((1 - std::exp(-0.5)) * (0.001 + 1e-7)), 1e-4);
}

}  // namespace
}  // namespace roxel

// The thesis's switches that change a sample along its ray: each by its formula.
#include <gtest/gtest.h>

#include "roxel/infer/infer_fixture.h"
#include "roxel/infer/pass_twin.h"

namespace roxel {
namespace {

using fixture::camera_at;
using fixture::plain_image;
using fixture::plan_of;
using fixture::view_of;

RegionStats sample_of(const std::array<float, 3>& mean, float spread) {
  return {{mean[0], mean[1], mean[2]}, {spread, spread, spread, 0.5f * spread, 0, 0}, 1, 1};
}

TEST(RemovedColor, OneVoxelIsTheFormula) {
  RemovedColor removed;
  const float c[3] = {10, 20, 30}, s[6] = {4, 5, 6, 1, 2, 3}, a = 0.25f;
  removed.remove(a, c, s, 0.9f);
  const RegionStats seen = sample_of({40, 41, 42}, 8), rest = removed.apply(seen);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(rest.mean[i], (seen.mean[i] - a * c[i]) / (1 - a), 1e-4);
  for (int i = 0; i < 6; ++i)
    EXPECT_NEAR(rest.cov[i], (seen.cov[i] + a * a * s[i]) / ((1 - a) * (1 - a)), 1e-4);
  EXPECT_EQ(rest.foreground, seen.foreground);
}

TEST(RemovedColor, TwoVoxelsAreTheFormulaTwice) {
  RemovedColor once, both;
  const float c1[3] = {10, 20, 30}, s1[6] = {4, 5, 6, 1, 2, 3}, c2[3] = {-5, 0, 60},
              s2[6] = {1, 9, 2, 0, 1, 0};
  both.remove(0.25f, c1, s1, 0.9f);
  both.remove(0.6f, c2, s2, 0.9f);
  once.remove(0.25f, c1, s1, 0.9f);
  RemovedColor second;
  second.remove(0.6f, c2, s2, 0.9f);
  const RegionStats seen = sample_of({40, 41, 42}, 8);
  const RegionStats expected = second.apply(once.apply(seen)), got = both.apply(seen);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(got.mean[i], expected.mean[i], 1e-3);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(got.cov[i], expected.cov[i], 1e-3);
}

TEST(RemovedColor, AtTheLimitNothingIsRemoved) {
  const float c[3] = {10, 20, 30}, s[6] = {4, 5, 6, 1, 2, 3};
  RemovedColor removed;
  removed.remove(0.9f, c, s, 0.9f);
  removed.remove(1, c, s, 0.9f);
  const RegionStats seen = sample_of({40, 41, 42}, 8), rest = removed.apply(seen);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(rest.mean[i], seen.mean[i]);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(rest.cov[i], seen.cov[i]);
}

/// Voxels (2, 4, 4) and (5, 4, 4) on the ray of a one-pixel camera, of the given opacities and colours.
class TwoVoxelRay : public ::testing::Test {
 protected:
  TwoVoxelRay() {
    Topology topology(LatticeFrame{{0, 0, 0}, 1, {1, 1, 1}});
    topology.insert({2, 4, 4});
    topology.insert({5, 4, 4});
    volume_ = Volume({topology});
    for (int i = 0; i < 2; ++i) volume_.tau[i] = static_cast<float>(-std::log(1 - kOpacity[i]));
    model_.evidence_half = 0;
    model_.outlier = 0;
  }

  EvaluatedSteps march(const Image& image, const SamplePlan& plan = plan_of({1, 100}, 0)) {
    const SampleView view = view_of(camera_, image, plan);
    const LatticeStack stack(volume_);
    NodeScratch scratch(stack, volume_.tau);
    std::vector<ColorTotals> totals(2);
    for (int i = 0; i < 2; ++i) {
      TwinColor color;
      color.add(1, colors_[i], spread_ * Eigen::Matrix3d::Identity());
      const Eigen::Matrix3d& s = color.second;
      const double moments[10] = {1,       color.first[0], color.first[1], color.first[2], s(0, 0),
                                  s(1, 1), s(2, 2),        s(0, 1),        s(0, 2),        s(1, 2)};
      for (int c = 0; c < 10; ++c) totals[i][c] = std::llrint(moments[c] * kColorUnit);
    }
    scratch.compare_with(totals);
    SegmentMarch march(stack, scratch, model_, background_, filters_);
    RemovedColor removed;
    EvaluatedSteps steps;
    const Region region{0, pixel_, pixel_};
    march.march(view, region, view.pyramid->at(0, pixel_, pixel_), region_ray(view, region), plan.range,
                nullptr, removed, steps);
    return steps;
  }

  /// Agreement of a sample of this mean and covariance with voxel i.
  double agreement_with(int i, const Eigen::Vector3d& mean, const Eigen::Matrix3d& cov) const {
    return twin_agreement(model_, colors_[i] - mean, spread_ * Eigen::Matrix3d::Identity() + cov);
  }

  static constexpr double kOpacity[2] = {0.4, 0.7};
  Eigen::Vector3d colors_[2] = {{40, 10, -20}, {60, -15, 5}};
  double spread_ = 9;
  Volume volume_;
  MatchModel model_;
  Background background_;
  SampleFilters filters_;
  PinholeCamera camera_ = camera_at({-20, 4.5, 4.5}, {4.5, 4.5, 4.5}, 1, 10);
  int pixel_ = 0;
};
constexpr double TwoVoxelRay::kOpacity[2];

Image image_of(const Eigen::Vector3d& color) {
  return plain_image(
      1, {static_cast<float>(color[0]), static_cast<float>(color[1]), static_cast<float>(color[2])});
}

TEST_F(TwoVoxelRay, FilterRaysRemovesWhatTheFirstVoxelExplains) {
  const Eigen::Vector3d seen = kOpacity[0] * colors_[0] + (1 - kOpacity[0]) * colors_[1];
  const EvaluatedSteps plain = march(image_of(seen));
  filters_.rays = true;
  const EvaluatedSteps filtered = march(image_of(seen));
  ASSERT_EQ(plain.size(), 2u);
  ASSERT_EQ(filtered.size(), 2u);
  const Eigen::Matrix3d none = Eigen::Matrix3d::Zero();
  EXPECT_NEAR(plain[0].likelihood, agreement_with(0, seen, none), 1e-5);
  EXPECT_NEAR(plain[1].likelihood, agreement_with(1, seen, none), 1e-5);
  EXPECT_EQ(filtered[0].likelihood, plain[0].likelihood);
  // Behind the first voxel the sample is the second's colour, with a^2 Sigma_v / (1 - a)^2 of uncertainty.
  const double a = kOpacity[0], spread = a * a * spread_ / ((1 - a) * (1 - a));
  const double expected = agreement_with(1, colors_[1], spread * Eigen::Matrix3d::Identity());
  EXPECT_NEAR(filtered[1].likelihood, expected, 1e-4);
  EXPECT_GT(filtered[1].likelihood, 3 * plain[1].likelihood);
}

TEST_F(TwoVoxelRay, FilterRaysStopsAtItsLimit) {
  const Eigen::Vector3d seen = kOpacity[0] * colors_[0] + (1 - kOpacity[0]) * colors_[1];
  const EvaluatedSteps plain = march(image_of(seen));
  filters_.rays = true;
  filters_.limit = 0.3f;  // below the first voxel's 0.4
  EXPECT_EQ(march(image_of(seen))[1].likelihood, plain[1].likelihood);
}

TEST_F(TwoVoxelRay, FilterBackgroundRemovesItsShare) {
  background_.kind = BackgroundKind::kKnown;
  const Eigen::Vector3d black(5, 0, 0);
  for (int c = 0; c < 3; ++c) background_.mean[c] = static_cast<float>(black[c]);
  background_.cov[0] = background_.cov[1] = background_.cov[2] = 2;
  const double share = (1 - kOpacity[0]) * (1 - kOpacity[1]);
  const Eigen::Vector3d seen = share * black + (1 - share) * colors_[1];
  const EvaluatedSteps plain = march(image_of(seen));
  filters_.background = true;
  const EvaluatedSteps filtered = march(image_of(seen));
  const double spread = share * share * 2 / ((1 - share) * (1 - share));
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(plain[i].likelihood, agreement_with(i, seen, Eigen::Matrix3d::Zero()), 1e-5);
    EXPECT_NEAR(filtered[i].likelihood, agreement_with(i, colors_[1], spread * Eigen::Matrix3d::Identity()),
                1e-4);
  }
  EXPECT_GT(filtered[1].likelihood, 1.2 * plain[1].likelihood);
}

TEST_F(TwoVoxelRay, FilterBackgroundNeedsAKnownBackground) {
  const EvaluatedSteps plain = march(image_of(colors_[0]));
  filters_.background = true;
  background_.kind = BackgroundKind::kUnknown;
  EXPECT_EQ(march(image_of(colors_[0]))[0].likelihood, plain[0].likelihood);
}

/// Colours that grow by (12, 9) a pixel along x and y.
Image ramp_image() {
  Image ramp(3, 3, 3);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 3; ++x) {
      ramp.pixel(x, y)[0] = 50 + 12.0f * x;
      ramp.pixel(x, y)[1] = -10 + 9.0f * y;
    }
  return ramp;
}

/// Means that a colour march gives to the two voxels of the ray, or NaN where it gives nothing.
class TwoColoredVoxels : public TwoVoxelRay {
 protected:
  std::array<Eigen::Vector3d, 2> coloured(const Image& image, bool everywhere = false) {
    for (int i = 0; i < 2; ++i) {
      volume_.color_weight[i] = 1;
      for (int c = 0; c < 3; ++c) volume_.color_mean[i][c] = static_cast<float>(colors_[i][c]);
      volume_.color_cov[i] = PackedCovariance({9, 9, 9, 0, 0, 0});
    }
    const SampleView view = view_of(camera_, image, plan_of({1, 100}, 0));
    const LatticeStack stack(volume_);
    NodeScratch scratch(stack, volume_.tau);
    MarchOptions options;
    options.model = model_;
    options.background = background_;
    options.filters = filters_;
    march_color(stack, {view}, options, everywhere, RunContext(1), scratch);
    std::array<Eigen::Vector3d, 2> means;
    for (int i = 0; i < 2; ++i)
      for (int c = 0; c < 3; ++c) means[i][c] = scratch[i].mean[c] / scratch[i].evidence;
    return means;
  }
};

TEST_F(TwoColoredVoxels, FilterRaysColoursVoxelsBehindWithWhatGoesOn) {
  const Eigen::Vector3d seen = kOpacity[0] * colors_[0] + (1 - kOpacity[0]) * colors_[1];
  EXPECT_LT((coloured(image_of(seen))[1] - seen).norm(), 1e-3);
  filters_.rays = true;
  const auto means = coloured(image_of(seen));
  EXPECT_LT((means[0] - seen).norm(), 1e-3);
  EXPECT_LT((means[1] - colors_[1]).norm(), 1e-3);
  // In the very first pass nothing is known that could be removed.
  EXPECT_LT((coloured(image_of(seen), true)[1] - seen).norm(), 1e-3);
}

// What is left of a sample behind many voxels of other colours is divided by little: it must end in time.
TEST(FilteredColors, StayNumbersBehindManyVoxelsOfOtherColours) {
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {6, 1, 1}});
  for (int x = 0; x < 48; ++x) topology.insert({x, 4, 4});
  Volume volume({topology});
  for (std::uint32_t slot = 0; slot < volume.slot_count(); ++slot) {
    volume.tau[slot] = 2.2f;  // opacity 0.89, just below the limit
    volume.color_weight[slot] = 1;
    volume.color_mean[slot] = {20, -30, 40};
    volume.color_cov[slot] = PackedCovariance({9, 9, 9, 0, 0, 0});
  }
  for (const UpdateRule rule : {UpdateRule::kPosterior, UpdateRule::kRoxels}) {
    const SampleView view = view_of(camera_at({-20, 4.5, 4.5}, {4.5, 4.5, 4.5}, 1, 10),
                                    plain_image(1, {70, 10, -20}), plan_of({1, 100}, 0));
    const LatticeStack stack(volume);
    NodeScratch scratch(stack, volume.tau);
    MarchOptions options;
    options.rule = rule;
    options.filters.rays = true;
    march_color(stack, {view}, options, false, RunContext(1), scratch);
    EXPECT_GT(scratch[0].evidence, 0.1f);
    for (const std::uint32_t number : scratch.entered_bricks()) {
      const Brick& brick = stack.brick(number);
      for (std::uint32_t slot = brick.first_slot; slot < brick.first_slot + brick.count(); ++slot)
        for (int c = 0; c < 6; ++c) ASSERT_LT(std::abs(scratch[slot].cov[c]), 1e9f) << slot;
    }
  }
}

TEST_F(TwoColoredVoxels, FilterBackgroundColoursWithoutItsShare) {
  background_.kind = BackgroundKind::kKnown;
  const Eigen::Vector3d black(5, 0, 0);
  for (int c = 0; c < 3; ++c) background_.mean[c] = static_cast<float>(black[c]);
  background_.cov[0] = background_.cov[1] = background_.cov[2] = 2;
  const double share = (1 - kOpacity[0]) * (1 - kOpacity[1]);
  const Eigen::Vector3d seen = share * black + (1 - share) * colors_[1];
  EXPECT_LT((coloured(image_of(seen))[1] - seen).norm(), 1e-3);
  filters_.background = true;
  for (const Eigen::Vector3d& mean : coloured(image_of(seen))) EXPECT_LT((mean - colors_[1]).norm(), 1e-3);
}

TEST_F(TwoColoredVoxels, InterpolateColoursWithTheColourAtTheVoxelsCentre) {
  camera_ = camera_at({-20, 4.7, 4.4}, {4.5, 4.6, 4.45}, 3, 20);
  const Image ramp = ramp_image();
  const auto plain = coloured(ramp);
  filters_.interpolate = true;
  const auto interpolated = coloured(ramp);
  for (int i = 0; i < 2; ++i) {
    // All rays that meet the voxel give it the one colour of its centre: the ramp is linear.
    const Eigen::Vector3d at = camera_.project({i == 0 ? 2.5 : 5.5, 4.5, 4.5});
    const Eigen::Vector3d there(50 + 12 * (at.x() - 0.5), -10 + 9 * (at.y() - 0.5), 0);
    EXPECT_LT((interpolated[i] - there).norm(), 1e-3);
    EXPECT_GT((plain[i] - there).norm(), 0.5);
  }
}

// The centre of a voxel that a pixel's ray passes aside of projects beside the pixel's centre: the colour
// there counts.
TEST_F(TwoVoxelRay, InterpolateComparesTheColourAtTheVoxelsCentre) {
  camera_ = camera_at({-20, 4.7, 4.4}, {4.5, 4.6, 4.45}, 3, 20);
  pixel_ = 1;
  const Image ramp = ramp_image();
  const EvaluatedSteps plain = march(ramp);
  filters_.interpolate = true;
  const EvaluatedSteps interpolated = march(ramp);
  ASSERT_EQ(interpolated.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d centre(i == 0 ? 2.5 : 5.5, 4.5, 4.5);
    const Eigen::Vector3d at = camera_.project(centre);
    const Eigen::Vector3d there(50 + 12 * (at.x() - 0.5), -10 + 9 * (at.y() - 0.5), 0);  // the ramp is linear
    const Eigen::Vector3d here(62, -1, 0);
    EXPECT_GT((there - here).norm(), 0.5);
    EXPECT_NEAR(plain[i].likelihood, agreement_with(i, here, Eigen::Matrix3d::Zero()), 1e-5);
    EXPECT_NEAR(interpolated[i].likelihood, agreement_with(i, there, Eigen::Matrix3d::Zero()), 1e-5);
  }
}

}  // namespace
}  // namespace roxel

#include "roxel/solve/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "roxel/base/error.h"
#include "roxel/solve/cube_fixture.h"

namespace roxel {
namespace {

using fixture::cube_dataset;
using fixture::cube_loader;
using ::testing::Contains;
using ::testing::HasSubstr;

ReconstructOptions surveyed_options() {
  ReconstructOptions options;
  options.bounds = {-0.8, -0.8, -0.8, 0.8, 0.8, 0.8};
  options.resolution = 32;
  options.levels = 2;
  return options;
}

Scene surveyed(const ReconstructOptions& options, const PhotographLoader& load) {
  return survey(cube_dataset(6, 24), load, options, RunContext(2));
}

TEST(Survey, TakesTheGivenBoxAndItsVoxelSize) {
  const Scene scene = surveyed(surveyed_options(), cube_loader());
  EXPECT_EQ(scene.bounds.box.max(), Eigen::Vector3d::Constant(0.8));
  EXPECT_DOUBLE_EQ(scene.voxel_size, 1.6 / 32);
  ReconstructOptions options = surveyed_options();
  options.voxel_size = 0.03;
  EXPECT_DOUBLE_EQ(surveyed(options, cube_loader()).voxel_size, 0.03);
}

TEST(Survey, WarnsOfABoxThatNoCameraSees) {
  EXPECT_THAT(surveyed(surveyed_options(), cube_loader()).warnings, ::testing::IsEmpty());
  ReconstructOptions options = surveyed_options();
  options.bounds = {100, 100, 100, 101, 101, 101};
  EXPECT_THAT(surveyed(options, cube_loader()).warnings, ::testing::Not(::testing::IsEmpty()));
}

TEST(Survey, WarnsOfOptionsThatCannotAct) {
  ReconstructOptions options = surveyed_options();
  options.matching_blur = 9;
  EXPECT_THAT(surveyed(options, cube_loader()).warnings, Contains(HasSubstr("--matching-blur")));
  options.matching = Matching::kLocal;  // chosen after the box: known to the warning all the same
  EXPECT_THAT(surveyed(options, cube_loader()).warnings, ::testing::IsEmpty());
}

TEST(Survey, RefusesMoreLevelsThanTheFinestLatticeHasRoomFor) {
  ReconstructOptions options = surveyed_options();
  options.levels = 16;
  try {
    surveyed(options, cube_loader());
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_THAT(error.what(), HasSubstr("--levels"));
  }
}

TEST(Survey, RefusesAbsurdVoxelSizes) {
  ReconstructOptions options = surveyed_options();
  options.voxel_size = 1e-6;
  EXPECT_THROW(surveyed(options, cube_loader()), InvalidInput);
}

TEST(Survey, ChoosesTheBackgroundFromTheImages) {
  EXPECT_EQ(surveyed(surveyed_options(), cube_loader()).background.kind, BackgroundKind::kKnown);
  EXPECT_EQ(surveyed(surveyed_options(), cube_loader(std::array{0.0f, 0.0f, 0.0f}, true)).background.kind,
            BackgroundKind::kMask);
}

TEST(Survey, DisplayWhiteIsTheExposureOfOrdinaryImages) {
  EXPECT_EQ(surveyed(surveyed_options(), cube_loader()).exposure, 1);
}

// Radiance 50 times above white: the exposure brings the median to middle grey, and colours with it.
TEST(Survey, HighDynamicRangeGetsAnExposure) {
  const Scene one = surveyed(surveyed_options(), cube_loader(std::array{0.3f, 0.3f, 0.3f}, false, 50));
  EXPECT_GT(one.exposure, 10);
  EXPECT_THAT(one.notes, Contains(HasSubstr("exposure")));
  const Scene ten = surveyed(surveyed_options(), cube_loader(std::array{0.3f, 0.3f, 0.3f}, false, 500));
  EXPECT_NEAR(ten.exposure / one.exposure, 10, 1e-4);
}

TEST(Survey, ABackgroundOfHighDynamicRangeIsMeasuredUnderTheExposure) {
  const Scene scene = surveyed(surveyed_options(), cube_loader(std::array{0.3f, 0.3f, 0.3f}, false, 50));
  ASSERT_EQ(scene.background.kind, BackgroundKind::kKnown);
  const float grey = static_cast<float>(0.3 * 50 / scene.exposure);
  float expected[3] = {grey, grey, grey};
  scene.transform.from_rgb(expected, expected);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(scene.background.mean[c], expected[c], 0.1);
}

TEST(Survey, WhitePointAndSpaceAreThoseAskedFor) {
  ReconstructOptions options = surveyed_options();
  options.white_point = "A";
  const Scene warm = surveyed(options, cube_loader());
  const Scene plain = surveyed(surveyed_options(), cube_loader());
  const float grey[3] = {0.5f, 0.5f, 0.5f};
  float under_a[3], under_d65[3];
  warm.transform.from_rgb(grey, under_a);
  plain.transform.from_rgb(grey, under_d65);
  EXPECT_NEAR(under_d65[1], 0, 0.1);  // daylight grey has no colour under D65, and is bluish under A:
  const double expected_u = 13 * under_a[0] * (kWhiteD65.u_prime() - kWhiteA.u_prime());
  EXPECT_NEAR(under_a[1], expected_u, 0.2);
  EXPECT_LT(under_a[1], -20);
  options.color_space = ColorSpace::kRgb;
  EXPECT_EQ(surveyed(options, cube_loader()).transform.space(), ColorSpace::kRgb);
  options.white_point = "blue";
  EXPECT_THROW(surveyed(options, cube_loader()), InvalidInput);
}

TEST(Survey, ModelFollowsTheOptions) {
  ReconstructOptions options = surveyed_options();
  options.noise = 6;
  options.outlier = 1e-5;
  options.evidence_half = 0.4;
  const Scene scene = surveyed(options, cube_loader());
  for (const float variance : scene.model.noise_variance) EXPECT_FLOAT_EQ(variance, 36);
  EXPECT_FLOAT_EQ(scene.model.outlier, 1e-5f);
  EXPECT_FLOAT_EQ(scene.model.evidence_half, 0.4f);
  // p_0 is the unknown background's density, (2 pi)^{3/2} 6^3 over the gamut's volume.
  const double p_0 = std::pow(2 * M_PI, 1.5) * 216 / gamut_volume(ColorSpace::kLuv);
  EXPECT_NEAR(scene.model.uninformative, p_0, 1e-3 * p_0);
  EXPECT_FLOAT_EQ(scene.background.unknown_likelihood, scene.model.uninformative);
  options.predictive = false;
  EXPECT_EQ(surveyed(options, cube_loader()).model.evidence_half, 0);
}

TEST(Survey, SurroundReachesAsFarAsRaysDo) {
  ReconstructOptions options = surveyed_options();
  options.far = 40;
  for (const SurroundChoice choice : {SurroundChoice::kOn, SurroundChoice::kAuto}) {
    options.surround = choice;
    options.background = BackgroundChoice::kUnknown;
    const Scene scene = surveyed(options, cube_loader());
    ASSERT_GT(scene.surround_count, 0);
    const std::vector<LatticeFrame> frames = frames_of_first_level(scene, options);
    ASSERT_EQ(static_cast<int>(frames.size()), scene.surround_count + 1);
    const Dataset dataset = cube_dataset(6, 24);
    for (const View& view : dataset.views)
      for (const double u : {0.5, 12.0, 23.5})
        for (const double v : {0.5, 12.0, 23.5}) {
          const Ray ray = view.camera.ray(u, v);
          EXPECT_TRUE(frames.back().box().contains(ray.origin + 40 * ray.direction));
        }
    // At most one lattice more than it takes (the innermost is padded to whole bricks).
    EXPECT_LT(0.5 * frames.back().box().sizes().maxCoeff(), 4 * 43);
  }
}

TEST(Survey, SurroundIsForBackgroundsThatAreNotKnown) {
  ReconstructOptions options = surveyed_options();
  EXPECT_EQ(surveyed(options, cube_loader()).surround_count, 0);  // auto, black background found
  options.surround = SurroundChoice::kOn;
  EXPECT_GT(surveyed(options, cube_loader()).surround_count, 0);
  options.surround = SurroundChoice::kOff;
  options.background = BackgroundChoice::kUnknown;
  EXPECT_EQ(surveyed(options, cube_loader()).surround_count, 0);
}

TEST(ViewRange, EndsBehindTheBoxWithoutSurround) {
  const Dataset dataset = cube_dataset(6, 24);
  const Scene scene = surveyed(surveyed_options(), cube_loader());
  const Stretch range = view_range(scene, dataset, 0);
  double farthest = 0, nearest = 1e9;
  for (int corner = 0; corner < 8; ++corner) {
    const double z =
        dataset.views[0]
            .camera
            .camera_from_world(scene.bounds.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)))
            .z();
    farthest = std::max(farthest, z);
    nearest = std::min(nearest, z);
  }
  EXPECT_GE(range.end, farthest);
  EXPECT_LE(range.end, 1.05 * farthest);
  EXPECT_LE(range.begin, nearest);
  EXPECT_GT(range.begin, 0);
}

TEST(MakeSamples, FollowTheLoaderNodesAndWeights) {
  const Dataset dataset = cube_dataset(6, 24);
  ReconstructOptions options = surveyed_options();
  const Scene scene = survey(dataset, cube_loader(), options, RunContext(1));
  const std::vector<SampleNode> nodes =
      make_samples(dataset, cube_loader(), scene, 0.1, options, RunContext(2));
  ASSERT_EQ(nodes.size(), dataset.nodes.size());
  const SampleView& view = nodes[dataset.views[2].node_idx].front();
  EXPECT_EQ(view.camera.pose.centre, dataset.views[2].camera.pose.centre);
  // A voxel of 0.1 at distance 3 covers (36 * 0.1 / 3)^2 pixels, which together make one observation.
  const double footprint = 36 * 0.1 / 3;
  EXPECT_NEAR(view.pixel_weight, options.observation_weight / (footprint * footprint), 1e-6);
  // The middle region shows the cube, in the matching space.
  const int level = view.plan.finest_level, middle = view.pyramid->width(level) / 2;
  EXPECT_GT(view.pyramid->at(level, middle, middle).mean[0], 20);
  options.observation_weight *= 3;
  EXPECT_NEAR(make_samples(dataset, cube_loader(), scene, 0.1, options, RunContext(1))[0][0].pixel_weight,
              3 * view.pixel_weight, 1e-6);
}

TEST(MakeSamples, PixelsOnOutlinesWeighLessWhereMasksAreTheBackground) {
  const Dataset dataset = cube_dataset(6, 48);
  const PhotographLoader load = cube_loader(std::array{0.0f, 0.0f, 0.0f}, true);
  ReconstructOptions options = surveyed_options();
  options.adaptive = false;
  Scene scene = survey(dataset, load, options, RunContext(1));
  ASSERT_EQ(scene.background.kind, BackgroundKind::kMask);
  const auto lost = [&](double weight) {
    options.outline_weight = weight;
    const auto nodes = make_samples(dataset, load, scene, 0.01, options, RunContext(1));
    double pixels = 48.0 * 48.0;
    const SampleView& view = nodes[0][0];
    const int level = view.plan.finest_level;
    for (int y = 0; y < view.pyramid->height(level); ++y)
      for (int x = 0; x < view.pyramid->width(level); ++x)
        pixels -= view.pyramid->at(level, x, y).valid * std::ldexp(1.0, 2 * level);
    return pixels;
  };
  EXPECT_NEAR(lost(1), 0, 1e-3);
  const double outline = lost(0);  // all around the cube
  EXPECT_GT(outline, 40);
  EXPECT_LT(outline, 200);
  EXPECT_NEAR(lost(0.5), outline / 2, 0.01 * outline);
  scene.background.kind = BackgroundKind::kUnknown;
  EXPECT_NEAR(lost(0), 0, 1e-3);
}

TEST(MostPasses, CoarseLevelsHaveTheirOwnAndMasksDoubleThem) {
  ReconstructOptions options;
  options.levels = 3;
  options.passes = 5;
  options.draft_passes = 3;
  Scene scene;
  scene.background.kind = BackgroundKind::kUnknown;
  const auto passes = [&] {
    std::vector<int> all;
    for (int level = 1; level <= 3; ++level) all.push_back(most_passes(scene, options, level));
    return all;
  };
  EXPECT_EQ(passes(), (std::vector{5, 5, 5}));
  EXPECT_EQ(most_drafts(scene, options, 1), 3);
  scene.background.kind = BackgroundKind::kMask;
  EXPECT_EQ(passes(), (std::vector{10, 10, 5}));
  scene.seen_from_inside = true;
  EXPECT_EQ(passes(), (std::vector{5, 5, 5}));
  scene.seen_from_inside = false;
  scene.surround_count = 3;
  EXPECT_EQ(passes(), (std::vector{5, 5, 5}));
  scene.surround_count = 0;
  options.coarse_passes = 2;
  EXPECT_EQ(passes(), (std::vector{2, 2, 5}));
  EXPECT_EQ(most_drafts(scene, options, 1), 1);
  EXPECT_EQ(most_drafts(scene, options, 3), 3);
}

TEST(MakeSamples, SmallVoxelsNeverWeighPixelsMoreThanOnce) {
  const Dataset dataset = cube_dataset(6, 24);
  const ReconstructOptions options = surveyed_options();
  const Scene scene = survey(dataset, cube_loader(), options, RunContext(1));
  const std::vector<SampleNode> nodes =
      make_samples(dataset, cube_loader(), scene, 0.01, options, RunContext(1));
  EXPECT_FLOAT_EQ(nodes[0][0].pixel_weight, static_cast<float>(options.observation_weight));
}

}  // namespace
}  // namespace roxel

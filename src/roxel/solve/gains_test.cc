#include "roxel/solve/gains.h"

#include <gtest/gtest.h>

#include <cmath>
#include <mutex>

#include "roxel/solve/cube_fixture.h"
#include "roxel/solve/run_stages.h"

namespace roxel {
namespace {

using fixture::cube_dataset;
using fixture::CubeWorld;
using fixture::lit_loader;
using fixture::true_light;

ReconstructOptions cube_options(IlluminationChoice illumination, Matching matching) {
  ReconstructOptions options;
  options.bounds = {-0.8, -0.8, -0.8, 0.8, 0.8, 0.8};
  options.resolution = 32;
  options.levels = 2;
  options.passes = 5;
  options.illumination = illumination;
  options.matching = matching;
  return options;
}

/// Share of the cube's pixels whose depth is within half a voxel.
double share_near(const Dataset& dataset, const PhotographLoader& load, const Reconstruction& made,
                  const ReconstructOptions& options) {
  std::mutex mutex;
  RunContext context(2);
  ViewStageOptions stages;
  stages.render = false;
  double near = 0, all = 0;
  for_each_view_result(dataset, load, made, options, stages, context, [&](const ViewResult& result) {
    const std::lock_guard lock(mutex);
    const PinholeCamera& camera = dataset.views[result.view_idx].camera;
    for (int y = 0; y < camera.intrinsics.height; ++y)
      for (int x = 0; x < camera.intrinsics.width; ++x)
        if (const std::optional<double> truth = CubeWorld::hit(camera.ray(x + 0.5, y + 0.5))) {
          ++all;
          near += *result.depth.opacity.pixel(x, y) > 0.5f &&
                  std::abs(*result.depth.depth.pixel(x, y) - *truth) < 0.5 * made.scene.voxel_size;
        }
  });
  return near / all;
}

Reconstruction run(const Dataset& dataset, const PhotographLoader& load, const ReconstructOptions& options) {
  RunContext context(2);
  return reconstruct(dataset, load, options, context);
}

/// Mean of log(green / the cube's own green) over opaque voxels.
double mean_log_color(const Reconstruction& made) {
  const auto colors = radiance_colors(made.volume, made.scene.transform, made.scene.exposure);
  const BrickIndex& index = made.volume.index(0);
  double sum = 0;
  int count = 0;
  for (const Brick& brick : index.bricks())
    brick.for_each_voxel([&](int v, std::uint32_t slot) {
      if (alpha_from_tau(made.volume.tau[slot]) < 0.5f || made.volume.color_weight[slot] <= 0) return;
      const Eigen::Vector3d at = index.frame().voxel_centre(voxel_of(brick, v));
      if (at.cwiseAbs().maxCoeff() > 0.5) return;
      const std::array<float, 3> truth = CubeWorld::color_at(at);
      sum += std::log(std::max(1e-3f, colors[slot][1]) / truth[1]), ++count;
    });
  return sum / count;
}

TEST(AutoIllumination, IsAGainWherePhotographsDifferAndNothingWhereTheyDoNot) {
  const Dataset dataset = cube_dataset(8, 48);
  ReconstructOptions options = cube_options(IlluminationChoice::kAuto, Matching::kAuto);
  options.resolution = 64;  // its first level has 32 voxels along a side
  // The light of lit_loader twice: up to a factor of four apart.
  const PhotographLoader twice = [&, once = lit_loader(dataset)](const View& view) {
    Photograph photo = once(view);
    const std::array<float, 3> light = true_light(static_cast<int>(&view - dataset.views.data()));
    for (std::size_t i = 0; i < photo.rgb.data().size(); ++i) photo.rgb.data()[i] *= light[i % 3];
    return photo;
  };
  const Reconstruction lit = run(dataset, twice, options);
  EXPECT_EQ(lit.scene.light.from, LightSource::kGain);
  EXPECT_GT(lit.summary.light.front().spread, 0.35);
  const Reconstruction constant =
      run(dataset, fixture::cube_loader(std::array<float, 3>{0, 0, 0}, true), options);
  EXPECT_EQ(constant.scene.light.from, LightSource::kNone);
  ASSERT_EQ(constant.summary.light.size(), 1u);
  EXPECT_LT(constant.summary.light.front().spread, 0.1);
  options.resolution = 48;
  EXPECT_TRUE(run(dataset, twice, options).summary.light.empty());  // too coarse to judge
}

TEST(SquaresOf, AreMeansOfWhatCountsAlone) {
  Photograph photo;
  photo.rgb = Image(7, 4, 3);  // three squares of two in a row; the last column is left over
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 7; ++x)
      for (int c = 0; c < 3; ++c) photo.rgb.pixel(x, y)[c] = 0.1f * static_cast<float>(x) + 0.01f * c;
  photo.rgb.pixel(5, 3)[1] = 1;  // clipped
  photo.foreground = Mask(7, 4);
  std::fill(photo.foreground.data().begin(), photo.foreground.data().end(), std::uint8_t{255});
  photo.foreground.at(2, 0) = 254;
  const PhotographSquares squares = squares_of(photo, 2, 1);
  ASSERT_EQ(squares.rgb.width(), 3);
  ASSERT_EQ(squares.rgb.height(), 2);
  EXPECT_EQ(squares.counted.at(0, 0), 255);
  EXPECT_EQ(squares.counted.at(1, 0), 0);
  EXPECT_EQ(squares.counted.at(1, 1), 255);
  EXPECT_EQ(squares.counted.at(2, 0), 255);
  EXPECT_EQ(squares.counted.at(2, 1), 0);
  EXPECT_NEAR(squares.rgb.pixel(1, 1)[0], 0.25, 1e-6);
  EXPECT_NEAR(squares.rgb.pixel(0, 0)[2], 0.07, 1e-6);
  EXPECT_EQ(squares_of(photo, 2, 20).counted.at(2, 1), 255);  // of photographs that do not clip at 1
}

TEST(SmallPhotographs, AreReadOnce) {
  const Dataset dataset = cube_dataset(3, 48);
  int reads = 0;
  const PhotographLoader load = [&](const View& view) {
    ++reads;
    return lit_loader(dataset)(view);
  };
  SmallPhotographs small(dataset, load);
  EXPECT_EQ(reads, 0);
  for (int round = 0; round < 3; ++round)
    for (int view = 0; view < 2; ++view) EXPECT_GT(small(view, 1).rgb.width(), 0);
  EXPECT_EQ(reads, 2);
}

TEST(FitGains, FindsTheLightOfEveryPhotograph) {
  const Dataset dataset = cube_dataset(14, 48);
  const PhotographLoader load = lit_loader(dataset);
  const ReconstructOptions none = cube_options(IlluminationChoice::kNone, Matching::kCanonical);
  const ReconstructOptions gain = cube_options(IlluminationChoice::kGain, Matching::kCanonical);
  const Reconstruction without = run(dataset, load, none), with = run(dataset, load, gain);

  std::array<double, 3> mean{0, 0, 0};
  for (int v = 0; v < 14; ++v)
    for (int c = 0; c < 3; ++c) mean[c] += std::log(true_light(v)[c]) / 14;
  for (int v = 0; v < 14; ++v)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(std::log(with.scene.light.of_views[v][c]), std::log(true_light(v)[c]) - mean[c], 0.06)
          << "view " << v << " channel " << c;
  EXPECT_TRUE(without.scene.light.of_views.empty());
  EXPECT_FALSE(with.summary.light.empty());
  EXPECT_GT(with.summary.light.front().largest_change, with.summary.light.back().largest_change);
  EXPECT_GT(share_near(dataset, load, with, gain), share_near(dataset, load, without, none) + 0.05);
}

/// The light of a view as a dome of its colour.
NodeSky dome_of(int view) {
  NodeSky sky;
  sky.model = SkyModel::kUniform;
  sky.sun_source = SunSource::kTime;
  for (int c = 0; c < 3; ++c) sky.channels[c].scale = true_light(view)[c];
  return sky;
}

// Pairs of photographs from one place, the second in an eighth of the light: each is painted by its own sky.
TEST(PaintByNormal, ANodeMayHaveSeveralSkies) {
  constexpr float kDark = 0.125f;
  const Dataset apart = cube_dataset(12, 32);
  Dataset pairs = apart;
  pairs.nodes.assign(6, {});
  for (int v = 0; v < 12; ++v) {
    pairs.views[v].node_idx = v / 2;
    pairs.nodes[v / 2].centre = apart.views[v].camera.pose.centre;
    pairs.nodes[v / 2].view_idxs.push_back(v);
  }
  Daylight daylight;
  for (int v = 0; v < 12; ++v) {
    NodeSky& sky = daylight.skies.emplace_back();
    sky.model = SkyModel::kUniform;
    sky.sun_source = SunSource::kTime;
    for (PerezChannel& channel : sky.channels) channel.scale = v % 2 == 0 ? 1 : kDark;
    daylight.sky_of_views.push_back(v);
  }
  const auto painted = [&](const Dataset& dataset) {
    const PhotographLoader load =
        [&, plain = fixture::cube_loader(std::array<float, 3>{0, 0, 0}, true)](const View& view) {
          Photograph photo = plain(view);
          if ((&view - dataset.views.data()) % 2 == 1)
            for (float& value : photo.rgb.data()) value *= kDark;
          return photo;
        };
    ReconstructOptions options = cube_options(IlluminationChoice::kSkyNormal, Matching::kCanonical);
    options.levels = 1;
    options.fit_colors = false;
    RunContext context(2);
    ReconstructHooks hooks;
    hooks.daylight = &daylight;
    return mean_log_color(reconstruct(dataset, load, options, context, hooks));
  };
  EXPECT_NEAR(painted(pairs), painted(apart), 0.05);  // with the first's sky for both: 0.54
}

// Two of three views have the light of their dome; the others are five times darker, and follow the volume.
TEST(FitGains, ViewsWithoutASkyAreHeldToTheScaleOfThoseWithOne) {
  const Dataset dataset = cube_dataset(15, 48);
  constexpr float kDark = 0.2f;
  const auto is_dark = [](int view) { return view % 3 == 1; };
  const PhotographLoader load = [&, once = lit_loader(dataset)](const View& view) {
    Photograph photo = once(view);
    if (is_dark(static_cast<int>(&view - dataset.views.data())))
      for (float& value : photo.rgb.data()) value *= kDark;
    return photo;
  };
  Daylight daylight;
  for (int v = 0; v < 15; ++v) {
    daylight.skies.push_back(is_dark(v) ? NodeSky() : dome_of(v));
    daylight.sky_of_views.push_back(v);
    daylight.sky_masked.push_back(1);
  }
  const std::vector<std::array<float, 3>> known = light_of_views(daylight);
  for (const IlluminationChoice choice : {IlluminationChoice::kSky, IlluminationChoice::kSkyNormal}) {
    RunContext context(2);
    ReconstructHooks hooks;
    hooks.daylight = &daylight;
    const Reconstruction made =
        reconstruct(dataset, load, cube_options(choice, Matching::kCanonical), context, hooks);
    const double scale = known[0][1] / true_light(0)[1];
    for (int v = 0; v < 15; ++v)
      for (int c = 0; c < 3; ++c) {
        if (!is_dark(v)) EXPECT_EQ(made.scene.light.of_views[v][c], known[v][c]);
        if (is_dark(v) && choice == IlluminationChoice::kSky)
          EXPECT_NEAR(std::log(made.scene.light.of_views[v][c]), std::log(kDark * true_light(v)[c] * scale),
                      0.1)
              << "view " << v << " channel " << c;
      }
    ASSERT_FALSE(made.summary.light.empty());
    EXPECT_EQ(made.summary.light.back().fitted_views, 5);
    ViewStageOptions stages;
    stages.depth = false;
    for_each_view_result(dataset, load, made, cube_options(choice, Matching::kCanonical), stages, context,
                         [&](const ViewResult& result) {
                           if (!is_dark(result.view_idx)) return;
                           double photographed = 0, rendered = 0;
                           for (std::size_t i = 0; i < result.photo.foreground.data().size(); ++i)
                             if (result.photo.foreground.data()[i] == 255) {
                               photographed += result.photo.rgb.data()[3 * i];
                               rendered += result.rendering.rgb.data()[3 * i];
                             }
                           EXPECT_NEAR(rendered / photographed, 1, 0.25) << result.view_idx;
                         });
  }
}

TEST(FitGains, RendersAreInThePhotographsOwnLight) {
  const Dataset dataset = cube_dataset(14, 48);
  const PhotographLoader load = lit_loader(dataset);
  const ReconstructOptions gain = cube_options(IlluminationChoice::kGain, Matching::kCanonical);
  const Reconstruction made = run(dataset, load, gain);
  ViewStageOptions stages;
  stages.depth = false;
  RunContext context(1);
  for_each_view_result(dataset, load, made, gain, stages, context, [&](const ViewResult& result) {
    double photographed = 0, rendered = 0;
    for (std::size_t i = 0; i < result.photo.foreground.data().size(); ++i)
      if (result.photo.foreground.data()[i] == 255) {
        photographed += result.photo.rgb.data()[3 * i];
        rendered += result.rendering.rgb.data()[3 * i];
      }
    EXPECT_NEAR(rendered / photographed, 1, 0.08) << result.view_idx;
  });
}

TEST(LocalMatching, FindsTheSurfaceWithoutGains) {
  const Dataset dataset = cube_dataset(14, 48);
  const PhotographLoader load = lit_loader(dataset);
  const ReconstructOptions canonical = cube_options(IlluminationChoice::kNone, Matching::kCanonical);
  const ReconstructOptions local = cube_options(IlluminationChoice::kNone, Matching::kLocal);
  EXPECT_GT(share_near(dataset, load, run(dataset, load, local), local),
            share_near(dataset, load, run(dataset, load, canonical), canonical) + 0.05);
}

TEST(LocalMatching, PaintsInCanonicalLight) {
  const Dataset dataset = cube_dataset(14, 48);
  const PhotographLoader load = fixture::cube_loader(std::array<float, 3>{0, 0, 0}, true);
  const auto mean = [&](Matching matching) {
    return mean_log_color(run(dataset, load, cube_options(IlluminationChoice::kNone, matching)));
  };
  // What is compared has a mean of 0.18, less than half of the cube's: voxels must not keep that.
  EXPECT_NEAR(mean(Matching::kLocal), mean(Matching::kCanonical), 0.1);
}

}  // namespace
}  // namespace roxel

#include "roxel/solve/reconstruct.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include "roxel/base/error.h"
#include "roxel/solve/cube_fixture.h"
#include "roxel/solve/estimate.h"
#include "roxel/solve/run_stages.h"
#include "roxel/volume/merge.h"

namespace roxel {
namespace {

using fixture::cube_dataset;
using fixture::cube_loader;
using fixture::CubeWorld;

ReconstructOptions cube_options() {
  ReconstructOptions options;
  options.bounds = {-0.8, -0.8, -0.8, 0.8, 0.8, 0.8};
  options.resolution = 32;
  options.levels = 2;
  options.passes = 4;
  return options;
}

/// The least of --memory, in GiB, that a run of these options takes.
double least_memory(const Dataset& dataset, const Scene& scene, ReconstructOptions options) {
  double low = 0, high = 64;
  while (high - low > 1e-6 * high) {
    options.memory = (low + high) / 2;
    (plan_memory(dataset, scene, options, 2).fits ? high : low) = *options.memory;
  }
  return high;
}

struct Hits {
  int surface = 0, near = 0, empty = 0, false_surface = 0;
};

/// Compares depth maps with the cube: pixels within one voxel along the ray, empty pixels given depth.
Hits compare(const Dataset& dataset, const PhotographLoader& load, const Reconstruction& reconstruction,
             const ReconstructOptions& options) {
  Hits hits;
  std::mutex mutex;
  RunContext context(2);
  ViewStageOptions stages;
  stages.render = false;
  for_each_view_result(
      dataset, load, reconstruction, options, stages, context, [&](const ViewResult& result) {
        const std::lock_guard lock(mutex);
        const PinholeCamera& camera = dataset.views[result.view_idx].camera;
        for (int y = 0; y < camera.intrinsics.height; ++y)
          for (int x = 0; x < camera.intrinsics.width; ++x) {
            const std::optional<double> truth = CubeWorld::hit(camera.ray(x + 0.5, y + 0.5));
            const bool found = *result.depth.opacity.pixel(x, y) > 0.5f;
            hits.surface += truth.has_value();
            hits.empty += !truth.has_value();
            hits.false_surface += !truth && found;
            hits.near +=
                truth && found &&
                std::abs(*result.depth.depth.pixel(x, y) - *truth) <= reconstruction.scene.voxel_size;
          }
      });
  return hits;
}

TEST(Reconstruct, FindsATexturedCube) {
  const Dataset dataset = cube_dataset(8, 48);
  for (const bool masks : {false, true}) {
    const PhotographLoader load = cube_loader(std::array{0.0f, 0.0f, 0.0f}, masks);
    RunContext context(2);
    const Reconstruction result = reconstruct(dataset, load, cube_options(), context);
    const Hits hits = compare(dataset, load, result, cube_options());
    EXPECT_GT(hits.surface, 2000);
    EXPECT_GT(hits.near, 0.85 * hits.surface) << (masks ? "masks" : "black background");
    EXPECT_LT(hits.false_surface, 0.05 * hits.empty);
  }
}

// A scene that goes on behind the box: auto finds no plain border, calls the background unknown and surrounds
// the box.
TEST(Reconstruct, ASceneThatGoesOnEndsInTheSurround) {
  const Dataset dataset = cube_dataset(12, 36);
  ReconstructOptions options = cube_options();
  options.passes = 3;
  options.draft_passes = 0;
  const PhotographLoader load = cube_loader(std::nullopt);
  RunContext context(2);
  const Reconstruction result = reconstruct(dataset, load, options, context);
  EXPECT_EQ(result.scene.background.kind, BackgroundKind::kUnknown);
  EXPECT_GT(result.volume.lattice_count(), 1);
  const Hits hits = compare(dataset, load, result, options);
  EXPECT_GT(hits.near, 0.7 * hits.surface);
  EXPECT_LT(hits.false_surface, 0.5 * hits.empty);  // twelve views 30 degrees apart leave much of it open
}

TEST(Reconstruct, IsTheSameForAnyNumberOfThreads) {
  const Dataset dataset = cube_dataset(7, 24);
  ReconstructOptions options = cube_options();
  options.resolution = 16;
  options.background = BackgroundChoice::kUnknown;  // with surround, the most that a run can have
  options.passes = 2;
  const auto run = [&](int threads) {
    RunContext context(threads);
    return reconstruct(dataset, cube_loader(), options, context);
  };
  const Reconstruction one = run(1);
  for (const int threads : {2, 4}) {
    const Reconstruction many = run(threads);
    EXPECT_EQ(many.volume.tau, one.volume.tau);
    EXPECT_EQ(many.volume.color_mean, one.volume.color_mean);
    EXPECT_EQ(many.volume.fitted_color, one.volume.fitted_color);
    EXPECT_EQ(many.volume.color_cov, one.volume.color_cov);
    EXPECT_EQ(many.volume.confidence, one.volume.confidence);
    EXPECT_EQ(many.volume.support, one.volume.support);
    ASSERT_EQ(many.summary.passes.size(), one.summary.passes.size());
    EXPECT_EQ(many.summary.passes.back().mean_log_likelihood, one.summary.passes.back().mean_log_likelihood);
  }
}

// Samples that do not stay in memory are loaded again and again, and change nothing.
TEST(Reconstruct, IsTheSameForAnyMemory) {
  const Dataset dataset = cube_dataset(7, 48);
  ReconstructOptions options = cube_options();
  options.resolution = 16;
  const auto run = [&](std::optional<double> memory, std::atomic<int>& loads) {
    options.memory = memory;
    const PhotographLoader load = [&](const View& view) {
      ++loads;
      return cube_loader()(view);
    };
    RunContext context(2);
    return reconstruct(dataset, load, options, context);
  };
  std::atomic<int> few{0}, many{0};
  const Reconstruction ample = run(std::nullopt, few);
  const Reconstruction tight = run(1.0001 * least_memory(dataset, ample.scene, options), many);
  EXPECT_LT(tight.scene.memory.sample_bytes, 1e5);
  EXPECT_GT(many, 2 * few);
  EXPECT_EQ(tight.volume.tau, ample.volume.tau);
  EXPECT_EQ(tight.volume.color_mean, ample.volume.color_mean);
  EXPECT_EQ(tight.volume.support, ample.volume.support);
}

TEST(Reconstruct, TooLittleMemoryIsSaidBeforeAnyPass) {
  ReconstructOptions options = cube_options();
  options.memory = 0.05;
  RunContext context(2);
  ReconstructHooks hooks;
  hooks.after_pass = [](const PassRecord&) { FAIL(); };
  try {
    reconstruct(cube_dataset(6, 24), cube_loader(), options, context, hooks);
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("--memory: found 0.05 GiB where about "), std::string::npos)
        << error.what();
  }
}

TEST(Reconstruct, HalvesVoxelsFromLevelToLevel) {
  ReconstructOptions options = cube_options();
  options.levels = 3;
  options.passes = 2;
  options.all_passes = true;
  int levels_seen = 0, passes_seen = 0;
  ReconstructHooks hooks;
  hooks.after_level = [&](const Volume& volume, const Scene&, const Summary& summary) {
    ++levels_seen;
    EXPECT_EQ(volume.box_slot_count(), summary.levels.back().voxels_in_box);
  };
  hooks.after_pass = [&](const PassRecord&) { ++passes_seen; };
  RunContext context(2);
  const Reconstruction result = reconstruct(cube_dataset(6, 32), cube_loader(), options, context, hooks);
  ASSERT_EQ(result.summary.levels.size(), 3u);
  EXPECT_EQ(levels_seen, 3);
  EXPECT_EQ(passes_seen, 6);
  for (int level = 0; level < 3; ++level)
    EXPECT_DOUBLE_EQ(result.summary.levels[level].voxel_size, std::ldexp(1.6 / 32, 2 - level));
  EXPECT_DOUBLE_EQ(result.volume.index(0).frame().voxel_size, 1.6 / 32);
  ASSERT_EQ(result.summary.passes.size(), 6u);
  EXPECT_EQ(result.summary.passes[3].level, 2);
  EXPECT_EQ(result.summary.passes[3].pass, 2);
  EXPECT_GT(result.summary.passes[3].steps, 0);
  EXPECT_EQ(result.summary.termination, "pass limit");
  EXPECT_FALSE(result.summary.brief().empty());
}

/// One level of up to 50 passes that ends where a pass changes opacities by less than 0.02.
Reconstruction run_to_rest(int draft_passes, double spatial_prior = 0.95) {
  ReconstructOptions options = cube_options();
  options.levels = 1;
  options.passes = 50;
  options.draft_passes = draft_passes;
  options.spatial_prior = spatial_prior;
  options.tolerance = 0.02;
  RunContext context(2);
  return reconstruct(cube_dataset(6, 32), cube_loader(), options, context);
}

TEST(Reconstruct, AccelerationIsAheadOfPlainPasses) {
  const auto likelihood = [](double acceleration, int passes) {
    ReconstructOptions options = cube_options();
    options.passes = passes;
    options.acceleration = acceleration;
    RunContext context(2);
    const Dataset dataset = cube_dataset(8, 48);
    const PhotographLoader load = cube_loader(std::array{0.0f, 0.0f, 0.0f}, true);
    return reconstruct(dataset, load, options, context).summary.passes.back().mean_log_likelihood;
  };
  EXPECT_GT(likelihood(4, 8), likelihood(1, 8) + 0.01);
  EXPECT_NEAR(likelihood(4, 16), likelihood(1, 16), 0.005);  // the same place in the end
}

// A pass that is asked for without options is a run's.
TEST(PassOptions, DefaultsAreThoseOfARun) {
  const PassOptions plain;
  const ReconstructOptions options;
  const PassOptions run = pass_options(lay_out(cube_dataset(6, 24), cube_loader(), options), options);
  EXPECT_EQ(run.opacity.rule, plain.opacity.rule);
  EXPECT_EQ(run.opacity.model.agreement, plain.opacity.model.agreement);
  for (int c = 0; c < 3; ++c)
    EXPECT_FLOAT_EQ(run.opacity.model.noise_variance[c], plain.opacity.model.noise_variance[c]);
  EXPECT_FLOAT_EQ(run.opacity.model.scale, plain.opacity.model.scale);
  EXPECT_FLOAT_EQ(run.opacity.model.evidence_half, plain.opacity.model.evidence_half);
  EXPECT_FLOAT_EQ(run.opacity.model.uninformative, plain.opacity.model.uninformative);
  EXPECT_FLOAT_EQ(run.opacity.model.outlier, plain.opacity.model.outlier);
  EXPECT_EQ(run.opacity.background.kind, plain.opacity.background.kind);
  EXPECT_FLOAT_EQ(run.opacity.background.unknown_likelihood, plain.opacity.background.unknown_likelihood);
  EXPECT_EQ(run.opacity.filters.rays, plain.opacity.filters.rays);
  EXPECT_EQ(run.opacity.filters.background, plain.opacity.filters.background);
  EXPECT_EQ(run.opacity.filters.interpolate, plain.opacity.filters.interpolate);
  EXPECT_EQ(run.opacity.ray_weights, plain.opacity.ray_weights);
  EXPECT_EQ(run.prior.opacity, plain.prior.opacity);
  EXPECT_EQ(run.prior.strength, plain.prior.strength);
  EXPECT_EQ(run.prior.spatial_lambda, plain.prior.spatial_lambda);
  EXPECT_EQ(run.predictive, plain.predictive);
  EXPECT_EQ(run.everywhere, plain.everywhere);
  EXPECT_EQ(run.kept_color_bytes, plain.kept_color_bytes);
  EXPECT_EQ(run.prior.strength, MergeOptions().prior_strength);
}

TEST(Reconstruct, ABoxThatNoRayMeetsIsAnError) {
  ReconstructOptions options = cube_options();
  options.bounds = {100, 100, 100, 101, 101, 101};
  RunContext context(1);
  EXPECT_THROW(reconstruct(cube_dataset(4, 16), cube_loader(), options, context), InvalidInput);
}

TEST(Reconstruct, SaysWhatWasSurveyedBeforeTheFirstPass) {
  Dataset dataset = cube_dataset(4, 16);
  dataset.notes = {"a note of the reader"};
  ReconstructOptions options = cube_options();
  options.voxel_size = 1e-3;  // far below a pixel
  options.levels = 7;
  options.passes = 1;
  std::vector<std::string> order, warnings;
  ReconstructHooks hooks;
  hooks.after_survey = [&](const Scene& scene) {
    order.push_back("survey");
    warnings = scene.warnings;
  };
  hooks.after_pass = [&](const PassRecord&) {
    order.push_back("pass");
    throw Cancelled();
  };
  RunContext context(1);
  EXPECT_THROW(reconstruct(dataset, cube_loader(), options, context, hooks), Cancelled);
  EXPECT_EQ(order, (std::vector<std::string>{"survey", "pass"}));
  EXPECT_FALSE(warnings.empty());
  options = cube_options();
  options.passes = 1;
  EXPECT_EQ(reconstruct(dataset, cube_loader(), options, context).summary.notes.front(),
            "a note of the reader");
}

// At a share of 1 every place goes that fewer nodes have in frame than what lies behind.
TEST(Reconstruct, LeavesOutWhatFewNodesHaveInFrame) {
  const auto made = [](double min_overlap) {
    ReconstructOptions options = cube_options();
    options.levels = 1;
    options.passes = 1;
    options.min_overlap = min_overlap;
    RunContext context(2);
    return reconstruct(cube_dataset(6, 24), cube_loader(), options, context);
  };
  const Reconstruction all = made(0), shared = made(1);
  EXPECT_LT(shared.volume.box_slot_count(), all.volume.box_slot_count());
  EXPECT_THAT(shared.summary.notes, ::testing::Contains(::testing::HasSubstr("overlap")));
  EXPECT_THAT(all.summary.notes, ::testing::Not(::testing::Contains(::testing::HasSubstr("overlap"))));
}

// All passes but the finest level's last are the same for any sharpness.
TEST(Reconstruct, OnlyTheVeryLastPassIsSharpened) {
  const auto changes = [](double sharpness) {
    ReconstructOptions options = cube_options();
    options.passes = 4;
    options.prior_sharpness = sharpness;
    std::vector<double> found;
    ReconstructHooks hooks;
    hooks.after_pass = [&](const PassRecord& pass) { found.push_back(pass.mean_opacity_change); };
    RunContext context(2);
    reconstruct(cube_dataset(6, 24), cube_loader(), options, context, hooks);
    return found;
  };
  std::vector<double> plain = changes(1), sharp = changes(2);
  ASSERT_EQ(plain.size(), sharp.size());
  EXPECT_GT(plain.size(), 5u);
  EXPECT_NE(plain.back(), sharp.back());
  plain.pop_back();
  sharp.pop_back();
  EXPECT_EQ(plain, sharp);
}

// The change of a sharpened pass is the prior's: it says nothing of whether opacities rest.
TEST(Reconstruct, ASharpenedPassDoesNotHideThatALevelRests) {
  const auto converged = [](double tolerance) {
    ReconstructOptions options = cube_options();
    options.levels = 1;
    options.passes = 12;
    options.all_passes = true;
    options.tolerance = tolerance;
    RunContext context(2);
    const Reconstruction made = reconstruct(cube_dataset(6, 24), cube_loader(), options, context);
    const std::vector<PassRecord>& passes = made.summary.passes;
    const double before = passes[passes.size() - 2].mean_opacity_change;
    EXPECT_GT(passes.back().mean_opacity_change, 1.5 * before);
    return std::pair(made.summary.levels.back().converged, before);
  };
  const auto [far, change] = converged(1e-9);
  EXPECT_FALSE(far);
  EXPECT_TRUE(converged(1.2 * change).first);
}

TEST(Reconstruct, CoarsePassesAreThoseOfLevelsBeforeTheLast) {
  const auto passes_by_level = [](int passes, int coarse_passes) {
    ReconstructOptions options = cube_options();
    options.levels = 3;
    options.passes = passes;
    options.coarse_passes = coarse_passes;
    options.draft_passes = 3;
    options.all_passes = true;
    std::vector<Progress> reports;
    RunContext context(1, [&](const Progress& progress) { reports.push_back(progress); });
    const Reconstruction made = reconstruct(cube_dataset(6, 24), cube_loader(), options, context);
    std::vector<std::pair<int, int>> levels(3);  // passes, and drafts of them
    for (const PassRecord& pass : made.summary.passes) {
      ++levels[pass.level - 1].first;
      levels[pass.level - 1].second += pass.draft;
    }
    for (std::size_t i = 0; i < reports.size(); ++i) {
      const Progress& report = reports[i];
      EXPECT_LE(report.fraction, 1);
      if (i > 0) EXPECT_GE(report.fraction, reports[i - 1].fraction);
      if (report.stage == "volume") EXPECT_EQ(report.pass_limit, levels[report.level - 1].first);
    }
    return levels;
  };
  using Levels = std::vector<std::pair<int, int>>;
  EXPECT_EQ(passes_by_level(5, 0), (Levels{{5, 3}, {5, 3}, {5, 3}}));
  EXPECT_EQ(passes_by_level(5, 2), (Levels{{2, 1}, {2, 1}, {5, 3}}));
  EXPECT_EQ(passes_by_level(2, 6), (Levels{{6, 3}, {6, 3}, {2, 1}}));
}

// What a run leaves is an EM step: the sums that merge adds up again.
TEST(Reconstruct, TheLastPassOfALevelIsPlain) {
  const auto only_pass = [](double acceleration) {
    ReconstructOptions options = cube_options();
    options.levels = 1;
    options.passes = 1;
    options.acceleration = acceleration;
    RunContext context(2);
    return reconstruct(cube_dataset(6, 24), cube_loader(), options, context).volume.tau;
  };
  EXPECT_EQ(only_pass(12), only_pass(1));
}

TEST(Reconstruct, CamerasInTheBoxHurryOnlyWhatFalls) {
  const auto first_pass_opacity = [](double acceleration) {
    ReconstructOptions options = cube_options();
    options.bounds = {-6, -6, -6, 6, 6, 6};
    options.resolution = 24;
    options.levels = 1;
    options.passes = 2;  // the last is never hurried
    options.acceleration = acceleration;
    RunContext context(2);
    const Dataset dataset = cube_dataset(6, 32);
    for (const View& view : dataset.views) EXPECT_LT(view.camera.pose.centre.cwiseAbs().maxCoeff(), 6);
    const PhotographLoader load = cube_loader(std::array{0.0f, 0.0f, 0.0f}, true);
    return reconstruct(dataset, load, options, context).summary.passes.front().mean_opacity;
  };
  EXPECT_LT(first_pass_opacity(12), first_pass_opacity(1));
}

TEST(Reconstruct, StopsALevelThatHasComeToRest) {
  const Reconstruction result = run_to_rest(0);
  EXPECT_LT(result.summary.passes.size(), 50u);
  EXPECT_TRUE(result.summary.levels.back().converged);
  EXPECT_EQ(result.summary.termination, "converged");
  // One that rests, and after it one that is not hurried.
  const std::size_t count = result.summary.passes.size();
  ASSERT_GE(count, 3u);
  EXPECT_LT(result.summary.passes[count - 2].mean_opacity_change, 0.02);
  for (std::size_t i = 0; i + 2 < count; ++i) EXPECT_GE(result.summary.passes[i].mean_opacity_change, 0.02);
}

TEST(Reconstruct, OpacitiesAtRestFollowFromTheLastPassAlone) {
  const Volume volume = run_to_rest(0, 0).volume;  // the same prior everywhere
  const ReconstructOptions options = cube_options();
  const double beta = options.prior_strength, tau_0 = -std::log1p(-options.prior_opacity);
  for (std::uint32_t slot = 0; slot < volume.slot_count(); ++slot) {
    const auto [hits, exposure] = volume.support[slot];
    const double em = (hits + beta * tau_0) / (exposure + beta);
    ASSERT_NEAR(volume.tau[slot], std::min(em, 16.0), 1e-4 * (1 + em)) << slot;
  }
}

TEST(Reconstruct, DraftsThatHaveComeToRestAreFollowedByPassesOnAllSamples) {
  const Reconstruction result = run_to_rest(40);
  const std::vector<PassRecord>& passes = result.summary.passes;
  const auto first_full =
      std::find_if(passes.begin(), passes.end(), [](const PassRecord& pass) { return !pass.draft; });
  ASSERT_NE(first_full, passes.begin());
  ASSERT_NE(first_full, passes.end());
  EXPECT_LT(first_full - passes.begin(), 40);
  EXPECT_LT((first_full - 1)->mean_opacity_change, 0.02);
  EXPECT_TRUE(std::none_of(first_full, passes.end(), [](const PassRecord& pass) { return pass.draft; }));
  EXPECT_GT(first_full->rays, 2 * passes.front().rays);
  EXPECT_TRUE(result.summary.levels.back().converged);
}

TEST(Reconstruct, TheLastPassOfALevelIsNeverADraft) {
  ReconstructOptions options = cube_options();
  options.passes = 2;
  options.draft_passes = 9;
  RunContext context(2);
  const Reconstruction result = reconstruct(cube_dataset(6, 24), cube_loader(), options, context);
  for (const PassRecord& pass : result.summary.passes) EXPECT_EQ(pass.draft, pass.pass == 1);
}

TEST(Reconstruct, ReportsProgressFromZeroToItsShare) {
  std::vector<Progress> reports;
  RunContext context(2, [&](const Progress& progress) { reports.push_back(progress); });
  ReconstructOptions options = cube_options();
  options.all_passes = true;
  reconstruct(cube_dataset(6, 32), cube_loader(), options, context, {}, 0.8);
  ASSERT_GT(reports.size(), 16u);  // more than one a pass
  EXPECT_LT(reports.front().fraction, 0.05);
  EXPECT_NEAR(reports.back().fraction, 0.8, 1e-9);
  std::size_t passes = 0;
  for (std::size_t i = 1; i < reports.size(); ++i) {
    EXPECT_GE(reports[i].fraction, reports[i - 1].fraction);
    if (reports[i].stage != "volume") continue;
    passes = i;
    EXPECT_GE(reports[i].level, reports[i - 1].level);
  }
  EXPECT_EQ(reports[passes].level, 2);
  EXPECT_EQ(reports[passes].pass, options.passes);
  EXPECT_EQ(reports.back().stage, "colours");
  EXPECT_LT(passes + 3, reports.size());
}

TEST(Reconstruct, StopsPromptlyWhenCancelledFromAnotherThread) {
  using Clock = std::chrono::steady_clock;
  std::atomic<bool> running{false};
  RunContext context(2, [&](const Progress&) { running = true; });
  ReconstructOptions options = cube_options();
  options.passes = 1000;
  options.all_passes = true;
  Clock::time_point cancelled_at;
  std::thread user([&] {
    while (!running) std::this_thread::yield();
    cancelled_at = Clock::now();
    context.cancel();
  });
  EXPECT_THROW(reconstruct(cube_dataset(8, 48), cube_loader(), options, context), Cancelled);
  const double seconds = std::chrono::duration<double>(Clock::now() - cancelled_at).count();
  user.join();
  EXPECT_LT(seconds, 2);
}

TEST(Reconstruct, ACancelledContextDoesNothing) {
  RunContext context(1);
  context.cancel();
  EXPECT_THROW(reconstruct(cube_dataset(6, 32), cube_loader(), cube_options(), context), Cancelled);
}

TEST(Reconstruct, FailuresOfTheLoaderReachTheCaller) {
  RunContext context(2);
  const PhotographLoader broken = [](const View& view) -> Photograph {
    throw_invalid(view.name, "0 bytes", "an image");
  };
  EXPECT_THROW(reconstruct(cube_dataset(6, 32), broken, cube_options(), context), InvalidInput);
}

TEST(Reconstruct, OptionsOutOfRangeAreRefused) {
  ReconstructOptions options = cube_options();
  options.spatial_prior = 1.5;
  RunContext context(1);
  EXPECT_THROW(reconstruct(cube_dataset(6, 32), cube_loader(), options, context), InvalidInput);
}

TEST(Reconstruct, MoreSamplesPerVoxelAreMoreSteps) {
  const auto steps = [](double samples_per_voxel) {
    ReconstructOptions options = cube_options();
    options.samples_per_voxel = samples_per_voxel;
    options.resolution = 8;  // voxels of 3 to 5 pixels
    options.levels = 1;
    options.passes = 1;
    RunContext context(2);
    return reconstruct(cube_dataset(6, 32), cube_loader(), options, context).summary.passes.back().steps;
  };
  EXPECT_GT(steps(1), 2 * steps(0.25));
  EXPECT_GT(steps(2), 1.2 * steps(1));  // no sample is finer than a pixel
}

// --init: the next run starts where the last one ended.
TEST(Reconstruct, StartsFromAnInitialVolume) {
  const Dataset dataset = cube_dataset(6, 32);
  ReconstructOptions options = cube_options();
  options.levels = 1;
  options.passes = 6;
  options.all_passes = true;
  RunContext context(2);
  const Reconstruction first = reconstruct(dataset, cube_loader(), options, context);
  options.passes = 1;
  ReconstructHooks hooks;
  hooks.initial = &first.volume;
  const Reconstruction cold = reconstruct(dataset, cube_loader(), options, context);
  const Reconstruction warm = reconstruct(dataset, cube_loader(), options, context, hooks);
  const double reached = first.summary.passes.back().mean_log_likelihood;
  EXPECT_GT(warm.summary.passes[0].mean_log_likelihood, cold.summary.passes[0].mean_log_likelihood + 0.5);
  EXPECT_GT(warm.summary.passes[0].mean_log_likelihood, reached - 0.1);
}

/// A volume of one brick at the origin with voxels of size s, each channel distinct.
Volume brick_of(double s, const Eigen::Vector3i& bricks) {
  Topology topology(LatticeFrame{{0, 0, 0}, s, bricks});
  for (int z = 0; z < 8 * bricks.z(); ++z)
    for (int y = 0; y < 8 * bricks.y(); ++y)
      for (int x = 0; x < 8 * bricks.x(); ++x)
        if ((x + y + z) % 5 != 0) topology.insert({x, y, z});
  Volume volume({topology});
  for (std::uint32_t slot = 0; slot < volume.slot_count(); ++slot) {
    volume.tau[slot] = 0.01f * (slot + 1);
    volume.confidence[slot] = 0.5f;
    volume.color_weight[slot] = 2 + slot;
    volume.color_mean[slot] = {1.0f * slot, 2, 3};
    volume.color_cov[slot] = PackedCovariance({4, 5.0f + slot, 6, 1, 0, 1});
  }
  return volume;
}

TEST(InitialiseFrom, TakesEachVoxelFromWhereItsCentreIs) {
  const Volume source = brick_of(1, {1, 1, 1});
  for (const double size : {0.5, 1.0, 2.0}) {  // finer, equal, coarser
    Topology topology(LatticeFrame{{0, 0, 0}, size, Eigen::Vector3i::Constant(2)});
    for (int z = 0; z < 16; ++z)
      for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) topology.insert({x, y, z});
    Volume volume({topology});
    std::fill(volume.tau.begin(), volume.tau.end(), 0.125f);
    initialise_from(source, volume);
    int taken = 0;
    for (int z = 0; z < 16; ++z)
      for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) {
          const std::uint32_t slot = volume.index(0).slot({x, y, z});
          const Eigen::Vector3d at = volume.index(0).frame().voxel_centre({x, y, z});
          const std::uint32_t from = source.index(0).slot(at.array().floor().cast<int>().matrix());
          if (from == kNoSlot) {
            EXPECT_EQ(volume.tau[slot], 0.125f);
            EXPECT_EQ(volume.color_weight[slot], 0);
            continue;
          }
          ++taken;
          EXPECT_NEAR(volume.tau[slot], source.tau[from] * size, 1e-6);  // tau is per voxel length
          EXPECT_EQ(volume.color_mean[slot], source.color_mean[from]);
          EXPECT_EQ(volume.color_cov[slot], source.color_cov[from]);
          EXPECT_EQ(volume.color_weight[slot], source.color_weight[from]);
          EXPECT_EQ(volume.confidence[slot], source.confidence[from]);
        }
    EXPECT_GT(taken, 20);
  }
}

}  // namespace
}  // namespace roxel

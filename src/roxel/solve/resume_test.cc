// A run that stops anywhere and goes on ends as one that never stopped.
#include <gtest/gtest.h>

#include "roxel/solve/cube_fixture.h"
#include "roxel/solve/reconstruct.h"

namespace roxel {
namespace {

using fixture::cube_dataset;
using fixture::cube_loader;

/// A run, and what it could have been resumed from.
struct Watched {
  Reconstruction made;
  std::vector<Checkpoint> checkpoints;
};

struct Variant {
  const char* name;
  Dataset dataset;
  PhotographLoader load;
  ReconstructOptions options;
};

Reconstruction run(const Variant& variant, const ReconstructHooks& hooks) {
  RunContext context(2);
  return reconstruct(variant.dataset, variant.load, variant.options, context, hooks);
}

Watched watched_run(const Variant& variant) {
  Watched result;
  ReconstructHooks hooks;
  hooks.checkpoint = [&](const CheckpointView& view) {
    result.checkpoints.push_back({view.state, view.summary, view.light, view.accelerated, view.volume});
  };
  result.made = run(variant, hooks);
  return result;
}

void expect_same(const Reconstruction& resumed, const Reconstruction& whole) {
  EXPECT_EQ(resumed.volume.tau, whole.volume.tau);
  EXPECT_EQ(resumed.volume.color_mean, whole.volume.color_mean);
  EXPECT_EQ(resumed.volume.fitted_color, whole.volume.fitted_color);
  EXPECT_EQ(resumed.volume.color_cov, whole.volume.color_cov);
  EXPECT_EQ(resumed.volume.color_weight, whole.volume.color_weight);
  EXPECT_EQ(resumed.volume.confidence, whole.volume.confidence);
  EXPECT_EQ(resumed.volume.support, whole.volume.support);
  EXPECT_EQ(resumed.scene.light.of_views, whole.scene.light.of_views);
  EXPECT_EQ(resumed.summary.termination, whole.summary.termination);
  ASSERT_EQ(resumed.summary.passes.size(), whole.summary.passes.size());
  for (std::size_t i = 0; i < whole.summary.passes.size(); ++i) {
    EXPECT_EQ(resumed.summary.passes[i].level, whole.summary.passes[i].level);
    EXPECT_EQ(resumed.summary.passes[i].pass, whole.summary.passes[i].pass);
    EXPECT_EQ(resumed.summary.passes[i].draft, whole.summary.passes[i].draft);
    EXPECT_EQ(resumed.summary.passes[i].mean_log_likelihood, whole.summary.passes[i].mean_log_likelihood);
  }
  EXPECT_EQ(resumed.summary.light.size(), whole.summary.light.size());
  ASSERT_EQ(resumed.summary.levels.size(), whole.summary.levels.size());
  for (std::size_t i = 0; i < whole.summary.levels.size(); ++i) {
    EXPECT_EQ(resumed.summary.levels[i].voxels_in_box, whole.summary.levels[i].voxels_in_box);
    EXPECT_EQ(resumed.summary.levels[i].converged, whole.summary.levels[i].converged);
  }
}

ReconstructOptions small_options() {
  ReconstructOptions options;
  options.bounds = {-0.8, -0.8, -0.8, 0.8, 0.8, 0.8};
  options.resolution = 16;
  options.levels = 2;
  options.passes = 6;
  options.draft_passes = 2;
  return options;
}

/// From every checkpoint of a run.
void expect_resumes_everywhere(const Variant& variant) {
  SCOPED_TRACE(variant.name);
  Watched whole = watched_run(variant);
  // One between each two passes of a level, and one after the level.
  EXPECT_EQ(whole.checkpoints.size(), whole.made.summary.passes.size());
  for (Checkpoint& checkpoint : whole.checkpoints) {
    SCOPED_TRACE("level " + std::to_string(checkpoint.state.level) + " pass " +
                 std::to_string(checkpoint.state.passes));
    const double seconds_before = checkpoint.summary.seconds;
    ReconstructHooks hooks;
    hooks.resume = &checkpoint;
    const Reconstruction resumed = run(variant, hooks);
    expect_same(resumed, whole.made);
    EXPECT_GT(resumed.summary.seconds, seconds_before);
    EXPECT_EQ(resumed.summary.notes.size(), whole.made.summary.notes.size() + 1);
  }
}

TEST(Resume, WithMasks) {
  expect_resumes_everywhere(
      {"masks", cube_dataset(6, 24), cube_loader(std::array{0.0f, 0.0f, 0.0f}, true), small_options()});
}

// An early rest shortens the drafts and leaves one plain pass: both are decided before the checkpoint.
TEST(Resume, WhereOpacitiesComeToRest) {
  ReconstructOptions options = small_options();
  options.tolerance = 0.02;
  options.passes = 12;
  const Variant variant{"rest", cube_dataset(6, 24), cube_loader(std::array{0.0f, 0.0f, 0.0f}, true),
                        options};
  EXPECT_EQ(watched_run(variant).made.summary.termination, "converged");
  expect_resumes_everywhere(variant);
}

// Whether the last level rests says the pass before its last, which may lie before the checkpoint.
TEST(Resume, WhereAllPassesAreDone) {
  ReconstructOptions options = small_options();
  options.tolerance = 0.05;
  options.passes = 8;
  options.all_passes = true;
  const Variant variant{"all passes", cube_dataset(6, 24), cube_loader(std::array{0.0f, 0.0f, 0.0f}, true),
                        options};
  EXPECT_EQ(watched_run(variant).made.summary.termination, "converged");
  expect_resumes_everywhere(variant);
}

TEST(Resume, WithSurround) {
  ReconstructOptions options = small_options();
  options.background = BackgroundChoice::kUnknown;
  options.passes = 3;
  expect_resumes_everywhere({"surround", cube_dataset(6, 24), cube_loader(std::nullopt), options});
}

TEST(Resume, WhileTheLightIsFound) {
  ReconstructOptions options = small_options();
  options.illumination = IlluminationChoice::kGain;
  options.matching = Matching::kLocal;
  options.passes = 4;
  const Dataset dataset = cube_dataset(8, 24);
  const Variant variant{"gain", dataset, fixture::lit_loader(dataset), options};
  EXPECT_GT(watched_run(variant).made.summary.light.size(), 2u);
  expect_resumes_everywhere(variant);
}

}  // namespace
}  // namespace roxel

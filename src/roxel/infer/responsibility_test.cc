// Responsibilities are probabilities: they sum to one along every path of samples from a root to a leaf. And
// rays compose: what is computed in pieces is what is computed in one go.
#include <gtest/gtest.h>

#include <set>

#include "roxel/infer/infer_fixture.h"
#include "roxel/infer/pass_twin.h"

namespace roxel {
namespace {

using fixture::camera_at;
using fixture::plan_of;
using fixture::random_image;
using fixture::random_volume;
using fixture::view_of;

/// Marches one view against the totals that one colour pass everywhere leaves.
struct OneView {
  Volume volume;
  SampleNode node;
  PassOptions options;
  LatticeStack stack{volume};
  NodeScratch scratch{stack, volume.tau};
  PassTwin twin{volume, options};
  PassCounts counts;

  OneView(Volume v, SampleView view, const PassOptions& chosen)
      : volume(std::move(v)), node{std::move(view)}, options(chosen) {
    PassOptions everywhere = options;
    everywhere.everywhere = true;
    CollectedColors collected(volume.slot_count(), 1, 0);
    collect_color(stack, {node}, everywhere, RunContext(1), nullptr, collected);
    const Totals& totals = collected.totals;
    PassTwin coloured(volume, everywhere);
    coloured.collect_color({node});
    std::vector<TwinColor> colors;
    for (const TwinVoxel& voxel : coloured.voxels()) colors.push_back(voxel.color);
    twin.compare_with(colors);
    scratch.compare_with(totals.color);
    counts = march_opacity(stack, node, options.opacity, RunContext(1), scratch);
  }
};

/// Adds up, path by path, the engine's hits over each sample's weight, and the twin's background.
struct PathSums {
  const OneView& one;
  std::vector<double> sums;
  std::set<int> cells;  ///< met so far: each must belong to one sample alone
  bool disjoint = true;

  void follow(const TwinSample& sample, double explained) {
    for (const TwinStep& step : sample.steps) {
      disjoint &= cells.insert(step.cell).second;
      explained += one.scratch[one.volume.index(0).slot(one.twin.ijk(step.cell))].hits / sample.weight;
    }
    if (sample.children.empty()) sums.push_back(explained + sample.background);
    for (const TwinSample& child : sample.children) follow(child, explained);
  }
};

/// One root sample of 4 x 4 pixels that divides twice, wide apart: a voxel meets one sample at most.
SampleView one_root(std::mt19937& random) {
  const PinholeCamera camera = camera_at({12.3, 11.6, -20}, {12.1, 12.2, 12}, 4, 6);
  return view_of(camera, random_image(4, random), plan_of({1, 60}, 2, {26, 34}));
}

class ResponsibilityTest : public ::testing::TestWithParam<std::tuple<UpdateRule, BackgroundKind, double>> {};

TEST_P(ResponsibilityTest, SumToOneOnEveryPath) {
  const auto [rule, background, largest_tau] = GetParam();
  std::mt19937 random(1);
  Volume volume = random_volume({3, 3, 3}, 0.6, 0.01, largest_tau, random);
  PassOptions options;
  options.opacity.rule = rule;
  options.opacity.background.kind = background;
  options.opacity.background.mean[0] = 45;
  const OneView one(std::move(volume), one_root(random), options);

  TwinSample root = one.twin.evaluate(one.node[0], {2, 0, 0}, one.node[0].plan.range.begin);
  one.twin.distribute(root);
  PathSums paths{one, {}, {}, true};
  paths.follow(root, 0);
  ASSERT_TRUE(paths.disjoint) << "the fixture: two samples share a voxel";
  ASSERT_EQ(paths.sums.size(), 16u);
  // Floats: some 40 steps a path, 1e-7 each, and likelihoods that differ from the twin's by 1e-5.
  for (const double sum : paths.sums) {
    if (rule == UpdateRule::kPosterior) {
      EXPECT_NEAR(sum, 1, 1e-3);
    } else {
      EXPECT_LE(sum, 1 + 1e-3);  // normalised by the largest path
    }
  }
  EXPECT_NEAR(*std::max_element(paths.sums.begin(), paths.sums.end()), 1, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Rules, ResponsibilityTest,
                         ::testing::Values(std::tuple(UpdateRule::kPosterior, BackgroundKind::kNone, 0.2),
                                           std::tuple(UpdateRule::kPosterior, BackgroundKind::kUnknown, 0.2),
                                           std::tuple(UpdateRule::kPosterior, BackgroundKind::kKnown, 0.1),
                                           std::tuple(UpdateRule::kPosterior, BackgroundKind::kUnknown, 4.0),
                                           std::tuple(UpdateRule::kRoxels, BackgroundKind::kUnknown, 0.2)));

// Without a background every ray ends in the volume: hits add up to the weight of all samples.
TEST(Responsibility, WithoutBackgroundHitsAddUpToTheObservations) {
  for (const int divisions : {0, 1, 2}) {
    std::mt19937 random(2);
    Volume volume = random_volume({1, 1, 1}, 1, 0.01, 0.4, random);
    const PinholeCamera camera = camera_at({4, 4, -16}, {4, 4, 4}, 8, 24);
    const SampleView view =
        view_of(camera, random_image(8, random),
                divisions == 0
                    ? plan_of({1, 60}, 0)
                    : plan_of({1, 60}, divisions,
                              divisions == 1 ? std::vector<double>{20.2} : std::vector<double>{18.3, 21.1}));
    PassOptions options;
    options.opacity.background.kind = BackgroundKind::kNone;
    const OneView one(std::move(volume), view, options);
    double hits = 0;
    for (std::uint32_t slot = 0; slot < one.volume.slot_count(); ++slot) hits += one.scratch[slot].hits;
    EXPECT_DOUBLE_EQ(one.counts.observation_weight, 64);
    EXPECT_NEAR(hits, 64, 64e-4) << divisions;
  }
}

}  // namespace
}  // namespace roxel

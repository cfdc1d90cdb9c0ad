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

/// A volume of one brick of another, with what the brick's voxels hold.
struct Piece {
  Volume volume;
  std::vector<ColorTotals> totals;
  std::uint32_t first_slot;  ///< in the other
};

Piece piece_of(const Volume& whole, const std::vector<ColorTotals>& totals, const Brick& brick) {
  BrickMask mask;
  for (int v = 0; v < kBrickVoxels; ++v) mask[v] = brick.local[v] != kNoVoxel;
  Topology topology(whole.index(0).frame());
  topology.insert_brick(brick.coord, mask);
  Piece piece{Volume({topology}), {}, brick.first_slot};
  for (std::uint32_t slot = 0; slot < brick.count; ++slot) {
    piece.volume.tau[slot] = whole.tau[brick.first_slot + slot];
    piece.totals.push_back(totals[brick.first_slot + slot]);
  }
  return piece;
}

/// Bricks along a ray, in its order.
std::vector<std::uint32_t> bricks_along(const Volume& volume, const Ray& ray, Stretch range) {
  std::vector<std::uint32_t> bricks;
  const LatticeStack stack(volume);
  stack.walk(
      ray, range, [&](std::uint32_t brick) { bricks.push_back(brick); },
      [](const VoxelStep&, const VoxelPlace&) { return true; });
  return bricks;
}

class Composition : public ::testing::Test {
 protected:
  Composition() : random_(3), volume_(random_volume({3, 3, 3}, 0.7, 0.01, 0.6, random_)) {
    std::uniform_real_distribution<float> color(-30, 60), unit(0, 1);
    for (std::uint32_t slot = 0; slot < volume_.slot_count(); ++slot) {
      totals_.push_back({});
      const float m[3] = {color(random_), color(random_), color(random_)}, w = unit(random_);
      totals_.back()[0] = std::llrint(w * kColorUnit);
      for (int c = 0; c < 3; ++c) totals_.back()[1 + c] = std::llrint(w * m[c] * kColorUnit);
      const float second[6] = {m[0] * m[0], m[1] * m[1], m[2] * m[2], m[0] * m[1], m[0] * m[2], m[1] * m[2]};
      for (int c = 0; c < 6; ++c)
        totals_.back()[4 + c] = std::llrint(w * (second[c] + (c < 3 ? 300 : 0)) * kColorUnit);
    }
    const PinholeCamera camera = camera_at({-14, 31, -11}, {12, 12, 12}, 16, 20);
    view_ = view_of(camera, random_image(16, random_), plan_of({1, 80}, 0));
  }

  Segment march(const Ray& ray, const RegionStats& sample, Stretch range, EvaluatedSteps& steps) {
    return march(volume_, totals_, ray, sample, range, steps);
  }

  Segment march(const Volume& volume, const std::vector<ColorTotals>& totals, const Ray& ray,
                const RegionStats& sample, Stretch range, EvaluatedSteps& steps) {
    const LatticeStack stack(volume);
    NodeScratch scratch(stack, volume.tau);
    scratch.compare_with(totals);
    SegmentMarch march(stack, scratch, model_, background_, filters_);
    march.set_early_stop(false);
    march.set_depths(true);
    RemovedColor removed;
    return march.march(view_, {0, 0, 0}, sample, ray, range, nullptr, removed, steps);
  }

  std::mt19937 random_;
  Volume volume_;
  std::vector<ColorTotals> totals_;
  SampleView view_;
  MatchModel model_;
  Background background_;
  SampleFilters filters_;
};

// Bricks may be anywhere: each marched alone and folded, they say what the whole volume says.
TEST_F(Composition, CutAtBrickPlanesARayIsTheSameBitForBit) {
  std::vector<Piece> pieces;
  for (const Brick& brick : volume_.index(0).bricks()) pieces.push_back(piece_of(volume_, totals_, brick));
  int cut_rays = 0;
  for (int pixel = 0; pixel < 256; ++pixel) {
    const int x = pixel % 16, y = pixel / 16;
    const RegionStats sample = view_.pyramid->at(0, x, y);
    const Ray ray = region_ray(view_, {0, x, y});
    EvaluatedSteps whole_steps, piece_steps;
    std::vector<std::uint32_t> piece_slots;
    const Segment whole = march(ray, sample, view_.plan.range, whole_steps);
    Segment folded;
    const std::vector<std::uint32_t> bricks = bricks_along(volume_, ray, view_.plan.range);
    for (const std::uint32_t brick : bricks) {
      const Piece& piece = pieces[brick];
      const std::size_t before = piece_steps.size();
      folded = folded.then(march(piece.volume, piece.totals, ray, sample, view_.plan.range, piece_steps));
      for (std::size_t s = before; s < piece_steps.size(); ++s)
        piece_slots.push_back(piece_steps[s].slot + piece.first_slot);
    }
    cut_rays += bricks.size() > 2;
    ASSERT_EQ(folded.transmittance, whole.transmittance);
    ASSERT_EQ(folded.likelihood, whole.likelihood);
    ASSERT_EQ(piece_steps.size(), whole_steps.size());
    for (std::size_t s = 0; s < whole_steps.size(); ++s) {
      ASSERT_EQ(piece_slots[s], whole_steps[s].slot);
      ASSERT_EQ(piece_steps[s].length, whole_steps[s].length);
      ASSERT_EQ(piece_steps.depth(s).middle, whole_steps.depth(s).middle);
      ASSERT_EQ(piece_steps.depth(s).half_chord, whole_steps.depth(s).half_chord);
      ASSERT_EQ(piece_steps[s].likelihood, whole_steps[s].likelihood);
      ASSERT_EQ(piece_steps[s].weight, whole_steps[s].weight);
    }
  }
  EXPECT_GT(cut_rays, 150);
}

TEST_F(Composition, CutAnywhereARayIsTheSameUpToRounding) {
  std::uniform_real_distribution<double> depth(10, 60);
  for (int pixel = 0; pixel < 256; ++pixel) {
    const int x = pixel % 16, y = pixel / 16;
    const RegionStats sample = view_.pyramid->at(0, x, y);
    const Ray ray = region_ray(view_, {0, x, y});
    const double cut = depth(random_);
    EvaluatedSteps steps;
    const Segment whole = march(ray, sample, view_.plan.range, steps);
    const Segment front = march(ray, sample, {view_.plan.range.begin, cut}, steps);
    const Segment back = march(ray, sample, {cut, view_.plan.range.end}, steps);
    const Segment folded = front.then(back);
    ASSERT_NEAR(folded.transmittance, whole.transmittance, 1e-5);
    ASSERT_NEAR(folded.likelihood, whole.likelihood, 1e-5);
  }
}

TEST_F(Composition, StoppingEarlyLeavesOutLessThanItsBound) {
  for (float& tau : volume_.tau) tau = 3;
  int stopped = 0;
  for (int pixel = 0; pixel < 256; ++pixel) {
    const int x = pixel % 16, y = pixel / 16;
    const RegionStats sample = view_.pyramid->at(0, x, y);
    const Ray ray = region_ray(view_, {0, x, y});
    EvaluatedSteps all, some;
    const Segment whole = march(ray, sample, view_.plan.range, all);
    const LatticeStack stack(volume_);
    NodeScratch scratch(stack, volume_.tau);
    scratch.compare_with(totals_);
    SegmentMarch march(stack, scratch, model_, background_, filters_);
    RemovedColor removed;
    const Segment early =
        march.march(view_, {0, x, y}, sample, ray, view_.plan.range, nullptr, removed, some);
    stopped += some.size() < all.size();
    // Likelihoods are at most 1 + outlier, so what lies behind adds at most T < kNegligible Z.
    ASSERT_LE(early.likelihood, whole.likelihood * (1 + 1e-6));
    ASSERT_GE(early.likelihood * (1 + SegmentMarch::kNegligible) * (1 + 1e-6), whole.likelihood);
    ASSERT_LE(std::abs(early.transmittance - whole.transmittance),
              SegmentMarch::kNegligible * early.likelihood + 1e-7);
  }
  EXPECT_GT(stopped, 50);
}

}  // namespace
}  // namespace roxel

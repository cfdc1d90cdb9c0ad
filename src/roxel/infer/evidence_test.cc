#include "roxel/infer/evidence.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <thread>

#include "roxel/base/parallel.h"
#include "roxel/infer/infer_fixture.h"

namespace roxel {
namespace {

using fixture::nodes_around;
using fixture::random_volume;

/// Everything that a pass leaves in a volume.
void expect_same_bits(const Volume& a, const Volume& b) {
  EXPECT_EQ(a.tau, b.tau);
  EXPECT_EQ(a.confidence, b.confidence);
  EXPECT_EQ(a.color_weight, b.color_weight);
  EXPECT_EQ(a.color_mean, b.color_mean);
  EXPECT_EQ(a.color_cov, b.color_cov);
  EXPECT_EQ(a.support, b.support);
}

class ExactSums : public ::testing::Test {
 protected:
  ExactSums() : random_(1), volume_(random_volume({2, 2, 2}, 0.6, 0.01, 1, random_)) {
    for (int divisions = 0; divisions < 3; ++divisions)
      for (SampleNode& node : nodes_around(volume_, 3, 16, divisions, random_))
        nodes_.push_back(std::move(node));
    nodes_[1].push_back(nodes_[4][0]);  // nodes of several views, so that workers take them out of order
    nodes_[6].push_back(nodes_[2][0]);
  }

  Volume after_passes(const std::vector<SampleNode>& nodes, int threads,
                      std::vector<PassReport>* reports = nullptr) {
    Volume volume = volume_;
    PassOptions options;
    for (int pass = 0; pass < 3; ++pass) {
      options.everywhere = pass == 0;
      const PassReport report = run_pass(nodes, options, RunContext(threads), nullptr, volume);
      if (reports) reports->push_back(report);
    }
    return volume;
  }

  std::mt19937 random_;
  Volume volume_;
  std::vector<SampleNode> nodes_;
};

TEST_F(ExactSums, AreTheSameForAnyNumberOfThreads) {
  std::vector<PassReport> one_reports;
  const Volume one = after_passes(nodes_, 1, &one_reports);
  for (const int threads : {2, 4}) {
    SCOPED_TRACE(threads);
    std::vector<PassReport> reports;
    expect_same_bits(after_passes(nodes_, threads, &reports), one);
    for (std::size_t i = 0; i < reports.size(); ++i) {
      EXPECT_EQ(reports[i].opacity.log_likelihood, one_reports[i].opacity.log_likelihood);
      EXPECT_EQ(reports[i].opacity.steps, one_reports[i].opacity.steps);
      EXPECT_EQ(reports[i].update.mean_opacity_change, one_reports[i].update.mean_opacity_change);
    }
  }
}

TEST_F(ExactSums, AreTheSameForAnyOrderOfNodes) {
  const Volume expected = after_passes(nodes_, 1);
  for (int trial = 0; trial < 3; ++trial) {
    std::vector<SampleNode> shuffled = nodes_;
    std::shuffle(shuffled.begin(), shuffled.end(), random_);
    expect_same_bits(after_passes(shuffled, 2), expected);
  }
}

TEST_F(ExactSums, TheVolumeDoesChange) {  // the tests above compare something
  const Volume after = after_passes(nodes_, 1);
  EXPECT_NE(after.tau, volume_.tau);
  EXPECT_NE(after.color_weight, volume_.color_weight);
}

/// A scratch whose voxels were filled by hand, one brick of `count` voxels.
struct HandFilled {
  Volume volume;
  LatticeStack stack;
  NodeScratch scratch;

  explicit HandFilled(int count) : volume(make(count)), stack(volume), scratch(stack, volume.tau) {
    scratch.enter(0);
  }
  static Volume make(int count) {
    Topology topology(LatticeFrame{{0, 0, 0}, 1, {1, 1, 1}});
    for (int i = 0; i < count; ++i) topology.insert({i, 0, 0});
    return Volume({topology});
  }
  /// Adds observations of one colour without spread.
  void observe(int slot, float weight, const Eigen::Vector3f& m) {
    VoxelScratch& voxel = scratch[slot];
    voxel.evidence += weight;
    const float second[6] = {m[0] * m[0], m[1] * m[1], m[2] * m[2], m[0] * m[1], m[0] * m[2], m[1] * m[2]};
    for (int c = 0; c < 3; ++c) voxel.mean[c] += weight * m[c];
    for (int c = 0; c < 6; ++c) voxel.cov[c] += weight * second[c];
  }
};

TEST(CappedColor, ANodeWeighsAtMostOneInAVoxel) {
  HandFilled filled(2);
  filled.observe(0, 3, {10, 20, -30});
  filled.observe(0, 5, {20, 20, -10});
  filled.observe(1, 0.25f, {10, 20, -30});
  const ColorTotals many = capped_color(filled.scratch[0]), few = capped_color(filled.scratch[1]);
  EXPECT_EQ(many[0], static_cast<std::int64_t>(kColorUnit));
  EXPECT_NEAR(many[1] / kColorUnit, (3 * 10 + 5 * 20) / 8.0, 1e-6);  // the mean stays
  EXPECT_NEAR(many[3] / kColorUnit, (3 * -30 + 5 * -10) / 8.0, 1e-6);
  EXPECT_EQ(few[0], static_cast<std::int64_t>(0.25 * kColorUnit));
  EXPECT_NEAR(few[1] / kColorUnit, 2.5, 1e-6);
  EXPECT_EQ(capped_color(VoxelScratch{}), ColorTotals{});
}

TEST(CappedColor, ComponentsSaturateBelowTwoToTheTenth) {
  HandFilled filled(1);
  filled.observe(0, 1, {1e6f, -1e6f, 5});
  const ColorTotals totals = capped_color(filled.scratch[0]);
  EXPECT_EQ(totals[1] / kColorUnit, 1023);
  EXPECT_EQ(totals[2] / kColorUnit, -1023);
  EXPECT_EQ(totals[4] / kColorUnit, 1023.0 * 1023.0);
  EXPECT_EQ(totals[7] / kColorUnit, -1023.0 * 1023.0);
  // Sums of 2^19 such nodes still fit into 63 bits.
  EXPECT_LT(static_cast<double>(totals[4]) * (1 << 19), std::ldexp(1.0, 63));
}

TEST(Totals, OpacitySumsSaturate) {
  HandFilled filled(2);
  filled.scratch[0].hits = 1e9f;
  filled.scratch[0].exposure = std::numeric_limits<float>::infinity();
  filled.scratch[1].hits = 12.5f;
  filled.scratch[1].looked = 0.75f;
  Totals totals(2);
  totals.add_opacity(filled.stack, filled.scratch);
  EXPECT_EQ(totals.opacity[0][0], static_cast<std::int64_t>(1) << 40);
  EXPECT_EQ(totals.opacity[0][1], static_cast<std::int64_t>(1) << 40);
  EXPECT_EQ(totals.opacity[1][0], static_cast<std::int64_t>(12.5 * kOpacityUnit));
  EXPECT_EQ(totals.opacity[1][2], static_cast<std::int64_t>(0.75 * kOpacityUnit));
}

TEST(Totals, LeavingANodeOutLeavesExactlyTheOthers) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> component(-100, 100), weight(0, 2);
  constexpr int kNodes = 5, kSlots = 8;
  std::vector<std::unique_ptr<HandFilled>> nodes;
  for (int n = 0; n < kNodes; ++n) {
    nodes.push_back(std::make_unique<HandFilled>(kSlots));
    for (int slot = n % 2; slot < kSlots; ++slot)
      nodes[n]->observe(slot, weight(random), {component(random), component(random), component(random)});
  }
  Totals all(kSlots);
  std::vector<std::vector<ColorTotals>> own(kNodes, std::vector<ColorTotals>(kSlots));
  for (int n = 0; n < kNodes; ++n) {
    all.add_color(nodes[n]->stack, nodes[n]->scratch);
    for (int slot = 0; slot < kSlots; ++slot) own[n][slot] = capped_color(nodes[n]->scratch[slot]);
  }
  for (int left_out = 0; left_out < kNodes; ++left_out) {
    NodeScratch& scratch = nodes[left_out]->scratch;
    scratch.compare_with(all.color);
    for (int slot = 0; slot < kSlots; ++slot) {
      ColorTotals others{};
      for (int n = 0; n < kNodes; ++n)
        for (int c = 0; c < 10; ++c) others[c] += n == left_out ? 0 : own[n][slot][c];
      const VoxelColor expected = color_of(others);
      EXPECT_EQ(scratch[slot].evidence, expected.evidence);
      for (int c = 0; c < 3; ++c) EXPECT_EQ(scratch[slot].mean[c], expected.mean[c]);
      for (int c = 0; c < 6; ++c) EXPECT_EQ(scratch[slot].cov[c], expected.cov[c]);
      EXPECT_EQ(scratch[slot].hits, 0);
    }
  }
}

TEST(Totals, ANodeAloneLeavesNothing) {
  HandFilled filled(3);
  filled.observe(1, 0.7f, {33.3f, -12.1f, 71.7f});
  Totals totals(3);
  totals.add_color(filled.stack, filled.scratch);
  filled.scratch.compare_with(totals.color);
  EXPECT_EQ(filled.scratch[1].evidence, 0);
  EXPECT_EQ(filled.scratch[1].mean[0], 0);
}

TEST(Totals, AddFromManyThreadsAtOnce) {
  constexpr int kSlots = 8, kAdditions = 400;
  HandFilled filled(kSlots);
  for (int slot = 0; slot < kSlots; ++slot) filled.observe(slot, 0.3f, {1.0f * slot, 2, 3});
  for (int slot = 0; slot < kSlots; ++slot) filled.scratch[slot].hits = 0.5f;
  Totals totals(kSlots);
  parallel_for(kAdditions, 4, [&](std::int64_t, int) {
    totals.add_color(filled.stack, filled.scratch);
    totals.add_opacity(filled.stack, filled.scratch);
  });
  const ColorTotals one = capped_color(filled.scratch[3]);
  for (int c = 0; c < 10; ++c) EXPECT_EQ(totals.color[3][c], kAdditions * one[c]);
  EXPECT_EQ(totals.opacity[3][0], static_cast<std::int64_t>(kAdditions * 0.5 * kOpacityUnit));
}

TEST(NodeScratch, BricksEnteredLaterGetTheTotals) {
  std::mt19937 random(3);
  Volume volume = random_volume({2, 1, 1}, 1, 0.1, 0.2, random);
  const LatticeStack stack(volume);
  std::vector<ColorTotals> totals(volume.slot_count());
  for (ColorTotals& t : totals) t = {1 << 24, 5 << 24, 0, 0, 30 << 24, 0, 0, 0, 0, 0};
  NodeScratch scratch(stack, volume.tau);
  scratch.enter(0);
  scratch.compare_with(totals);
  scratch.enter(1);
  const std::uint32_t late = stack.brick(1).first_slot;
  EXPECT_EQ(scratch[0].mean[0], 5);
  EXPECT_EQ(scratch[late].mean[0], 5);
  EXPECT_EQ(scratch[late].cov[0], 5);
  EXPECT_EQ(scratch[late].tau, volume.tau[late]);
  scratch.reset();
  EXPECT_TRUE(scratch.entered_bricks().empty());
  scratch.enter(1);
  EXPECT_EQ(scratch[late].evidence, 0);
}

/// Totals of a few colours of given weights.
ColorTotals totals_of(const std::vector<Eigen::Vector3d>& colors, const std::vector<double>& weights) {
  double sums[10] = {};
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const Eigen::Vector3d& m = colors[i];
    const double moments[10] = {1,           m[0],        m[1],        m[2],        m[0] * m[0],
                                m[1] * m[1], m[2] * m[2], m[0] * m[1], m[0] * m[2], m[1] * m[2]};
    for (int c = 0; c < 10; ++c) sums[c] += weights[i] * moments[c];
  }
  ColorTotals totals;
  for (int c = 0; c < 10; ++c) totals[c] = std::llrint(sums[c] * kColorUnit);
  return totals;
}

// Two or three colours span a line or a plane: their covariance is singular, and rounding must neither make
// it indefinite nor lose its off-diagonals.
TEST(ColorOf, CovarianceOfFewColoursIsRightAndSemiDefinite) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> component(-100, 100), unit(0.05, 1);
  for (int trial = 0; trial < 3000; ++trial) {
    std::vector<Eigen::Vector3d> colors;
    std::vector<double> weights;
    for (int i = 0; i < 2 + trial % 3; ++i) {
      colors.emplace_back(component(random), component(random), component(random));
      weights.push_back(unit(random));
    }
    const VoxelColor color = color_of(totals_of(colors, weights));
    const float* const cov = color.cov;
    double total = 0;
    Eigen::Vector3d m = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < colors.size(); ++i) total += weights[i], m += weights[i] * colors[i];
    m /= total;
    Eigen::Matrix3d s = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < colors.size(); ++i)
      s += weights[i] / total * (colors[i] - m) * (colors[i] - m).transpose();
    Eigen::Matrix3d got;
    got << cov[0], cov[3], cov[4], cov[3], cov[1], cov[5], cov[4], cov[5], cov[2];
    EXPECT_NEAR(color.evidence, total, 1e-6);
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(color.mean[c], m[c], 1e-4);
    ASSERT_LT((got - s).norm(), 1e-3 * s.norm()) << got << "\n\n" << s;
    ASSERT_GT(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(got).eigenvalues()[0], -1e-6 * s.norm());
  }
}

TEST(ColorOf, NoWeightIsAllZero) {
  const VoxelColor color = color_of({});
  EXPECT_EQ(color.evidence, 0);
  for (const float m : color.mean) EXPECT_EQ(m, 0);
  for (const float s : color.cov) EXPECT_EQ(s, 0);
}

}  // namespace
}  // namespace roxel

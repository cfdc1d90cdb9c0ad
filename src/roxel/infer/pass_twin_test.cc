#include "roxel/infer/pass_twin.h"

#include <gtest/gtest.h>

#include "roxel/infer/infer_fixture.h"
#include "roxel/march/brick_lists.h"

namespace roxel {
namespace {

using fixture::nodes_around;
using fixture::random_volume;

// Chords, opacities, likelihoods and sums are floats: about 1e-6 each, a few hundred of them in a sum.
constexpr double kTolerance = 1e-3;
// Covariances are differences of moments of about 6000, each rounded to some 1e-5 of itself.
constexpr double kCovTolerance = 0.06;

/// The largest difference of tau and colour between the engine's volume and the twin, relative to 1 + the
/// value.
struct Difference {
  double tau = 0, mean = 0, cov = 0, weight = 0, confidence = 0;
};

Difference difference(const Volume& volume, const PassTwin& twin) {
  Difference most;
  const auto raise = [](double& worst, double got, double expected) {
    const double off = std::abs(got - expected) / (1 + std::abs(expected));
    if (!(off <= worst)) worst = off;  // NaN is worst of all
  };
  for (int cell = 0; cell < static_cast<int>(twin.voxels().size()); ++cell) {
    const TwinVoxel& expected = twin.voxels()[cell];
    if (!expected.exists) continue;
    const std::uint32_t slot = volume.index(0).slot(twin.ijk(cell));
    raise(most.tau, volume.tau[slot], expected.tau);
    raise(most.confidence, volume.confidence[slot], expected.looked / (expected.looked + 2));
    raise(most.weight, volume.color_weight[slot], expected.color.weight);
    if (expected.color.weight < 1e-2) continue;  // fixed point leaves little of smaller sums
    const Eigen::Vector3d mean = expected.color.mean();
    const Eigen::Matrix3d cov = expected.color.cov();
    for (int c = 0; c < 3; ++c) raise(most.mean, volume.color_mean[slot][c], mean[c]);
    const std::array<float, 6> kept = volume.color_cov[slot].unpacked();
    const double expected_cov[6] = {cov(0, 0), cov(1, 1), cov(2, 2), cov(0, 1), cov(0, 2), cov(1, 2)};
    for (int c = 0; c < 6; ++c) raise(most.cov, kept[c], expected_cov[c]);
  }
  return most;
}

/// A prior of some weight, colours that agree a little and count from a fifth of a witness on: what rays
/// leave out where they stop early, and sums near the last bit of the totals, then stay below the tolerances.
PassOptions calm() {
  PassOptions options;
  options.prior.strength = 5;
  std::fill_n(options.opacity.model.noise_variance, 3, 16.0f);
  options.opacity.model.evidence_half = 0.2f;
  options.opacity.model.uninformative = options.opacity.background.unknown_likelihood = 0.001f;
  return options;
}

/// Runs `passes` passes of the engine, each from its own last result, and the twin beside it.
void expect_same(const PassOptions& chosen, int divisions, double largest_tau, unsigned seed) {
  std::mt19937 random(seed);
  Volume volume = random_volume({2, 1, 2}, 0.7, 0.005, largest_tau, random);
  const std::vector<SampleNode> nodes = nodes_around(volume, 4, 16, divisions, random);
  PassOptions options = chosen;
  for (int pass = 0; pass < 3; ++pass) {
    options.everywhere = pass == 0;
    PassTwin twin(volume, options);
    twin.run(nodes);
    const PassReport report = run_pass(nodes, options, RunContext(1), nullptr, volume);
    const Difference most = difference(volume, twin);
    EXPECT_LE(most.tau, kTolerance) << "pass " << pass;
    EXPECT_LE(most.confidence, kTolerance) << "pass " << pass;
    EXPECT_LE(most.weight, kTolerance) << "pass " << pass;
    EXPECT_LE(most.mean, kTolerance) << "pass " << pass;
    EXPECT_LE(most.cov, kCovTolerance) << "pass " << pass;
    if (options.opacity.rule == UpdateRule::kPosterior) {
      EXPECT_NEAR(report.opacity.log_likelihood, twin.log_likelihood(),
                  1e-4 * report.opacity.observation_weight);
    }
  }
}

TEST(RunPass, PosteriorIsItsSlowTwin) { expect_same(calm(), 0, 0.15, 1); }

/// Views in which the volume is small: whole tiles of samples meet nothing, and some only once divided.
std::vector<SampleNode> views_of_little(const Volume& volume, int divisions, std::mt19937& random) {
  const Eigen::Vector3d centre = volume.index(0).frame().box().center();
  constexpr int kSize = 92;  // no multiple of a tile
  std::vector<SampleNode> nodes;
  for (const Eigen::Vector3d& towards : {Eigen::Vector3d(1, 0.2, -0.3), Eigen::Vector3d(-0.4, 0.5, 1)}) {
    const PinholeCamera camera = fixture::camera_at(centre + 26 * towards.normalized(),
                                                    centre + Eigen::Vector3d(3, -2, 1), kSize, 0.55 * kSize);
    Mask valid(kSize, kSize, 255), foreground(kSize, kSize, 0);
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        if (x < 9 || (x + y) % 11 == 0) valid.data()[y * kSize + x] = 0;
        foreground.data()[y * kSize + x] = static_cast<std::uint8_t>((37 * x + 11 * y) % 256);
      }
    std::vector<double> divide_at;
    for (int d = 0; d < divisions; ++d) divide_at.push_back(22 + 4 * d);
    nodes.push_back({fixture::view_of(camera, fixture::random_image(kSize, random),
                                      fixture::plan_of({1, 60}, divisions, divide_at), valid, foreground)});
  }
  return nodes;
}

// What rays that meet nothing say is summed up without them.
TEST(RunPass, BackgroundsAroundALittleObjectAreTheirSlowTwins) {
  for (const BackgroundKind kind : {BackgroundKind::kUnknown, BackgroundKind::kKnown, BackgroundKind::kMask})
    for (int divisions = 0; divisions < 3; ++divisions) {
      SCOPED_TRACE(divisions);
      std::mt19937 random(12);
      Volume volume = random_volume({2, 1, 1}, 0.7, 0.005, 0.15, random);
      const std::vector<SampleNode> nodes = views_of_little(volume, divisions, random);
      const BrickLists lists(LatticeStack(volume), nodes[0][0].camera, nodes[0][0].plan);
      EXPECT_TRUE(lists.none_from(divisions, 0, 0));
      PassOptions options = calm();
      options.opacity.background.kind = kind;
      options.opacity.background.mean[0] = 30;
      PassTwin twin(volume, options);
      twin.run(nodes);
      const PassReport report = run_pass(nodes, options, RunContext(1), nullptr, volume);
      EXPECT_LE(difference(volume, twin).tau, kTolerance);
      EXPECT_NEAR(report.opacity.log_likelihood, twin.log_likelihood(),
                  1e-5 * std::abs(twin.log_likelihood()));
    }
}

TEST(RunPass, PosteriorWithoutPredictionIsItsSlowTwin) {
  PassOptions options = calm();
  options.predictive = false;
  options.opacity.model.evidence_half = 0;
  expect_same(options, 0, 0.15, 2);
}

TEST(RunPass, AdaptivePosteriorIsItsSlowTwin) {
  expect_same(calm(), 1, 0.15, 3);
  expect_same(calm(), 2, 0.15, 4);
}

TEST(RunPass, RayWeightsAreTheirSlowTwins) {
  PassOptions options = calm();
  options.opacity.ray_weights = true;
  expect_same(options, 1, 0.15, 5);
}

TEST(RunPass, SharpenedPriorIsItsSlowTwin) {
  PassOptions options = calm();
  options.prior.sharpness = 2;
  expect_same(options, 1, 0.8, 11);
}

TEST(RunPass, RoxelsRuleIsItsSlowTwin) {
  PassOptions options = calm();
  options.opacity.rule = UpdateRule::kRoxels;
  expect_same(options, 0, 0.15, 6);
  expect_same(options, 2, 0.15, 7);
}

TEST(RunPass, EveryAgreementIsItsSlowTwin) {
  for (const Agreement agreement : {Agreement::kExponential, Agreement::kLinear}) {
    PassOptions options = calm();
    options.opacity.model.agreement = agreement;
    options.opacity.model.scale = agreement == Agreement::kLinear ? 40 : 12;
    expect_same(options, 0, 0.15, 8);
  }
}

TEST(RunPass, EveryBackgroundIsItsSlowTwin) {
  for (const BackgroundKind kind : {BackgroundKind::kNone, BackgroundKind::kKnown, BackgroundKind::kMask}) {
    PassOptions options = calm();
    options.opacity.background.kind = kind;
    options.opacity.background.mean[0] = 30;
    options.opacity.background.mean[1] = -18;
    options.opacity.background.mean[2] = 27;
    expect_same(options, 1, 0.15, 9);
  }
}

// A sample at an outline colours voxels by the share of it that is object, one without object not at all.
TEST(MarchColor, WeighsSamplesByTheirForeground) {
  std::mt19937 random(6);
  const Volume volume = random_volume({1, 1, 1}, 0.8, 0.05, 0.4, random);
  const LatticeStack stack(volume);
  const PinholeCamera camera = fixture::camera_at({4, 4, -16}, {4, 4, 4}, 12, 30);
  const auto evidence = [&](std::uint8_t foreground) {
    const SampleNode node{fixture::view_of(camera, fixture::plain_image(12, {50, 10, -10}),
                                           fixture::plan_of({1, 60}, 0), {}, Mask(12, 12, foreground))};
    NodeScratch scratch(stack, volume.tau);
    march_color(stack, node, MarchOptions(), false, RunContext(1), scratch);
    double sum = 0;
    for (const std::uint32_t brick : scratch.entered_bricks())
      for (std::uint32_t v = 0; v < stack.brick(brick).count(); ++v)
        sum += scratch[stack.brick(brick).first_slot + v].evidence;
    return sum;
  };
  const double full = evidence(255);
  EXPECT_GT(full, 1);
  EXPECT_NEAR(evidence(51), 0.2 * full, 1e-3 * full);
  EXPECT_EQ(evidence(0), 0);
}

// A node's own colours are kept, or marched for again: in any mixture, to the same bits.
TEST(RunPass, KeepingOwnColorsChangesNoResult) {
  std::mt19937 random(5);
  const Volume start = random_volume({2, 2, 2}, 0.6, 0.01, 0.4, random);
  const std::vector<SampleNode> nodes = nodes_around(start, 4, 24, 1, random);
  const auto after = [&](std::size_t kept_bytes) {
    Volume volume = start;
    PassOptions options = calm();
    options.kept_color_bytes = kept_bytes;
    run_pass(nodes, options, RunContext(2), nullptr, volume);
    return volume;
  };
  CollectedColors collected(start.slot_count(), nodes.size(), std::size_t{1} << 30);
  const LatticeStack stack(start);
  collect_color(stack, nodes, PassOptions(), RunContext(1), nullptr, collected);
  for (std::size_t n = 0; n < nodes.size(); ++n) ASSERT_TRUE(collected.kept.of(n));
  const std::size_t one_node = collected.kept.of(0)->bytes();
  ASSERT_GT(one_node, 1000u);
  const Volume none = after(0);
  EXPECT_NE(none.tau, start.tau);
  for (const std::size_t bytes : {one_node + one_node / 2, std::size_t{1} << 30}) {
    const Volume some = after(bytes);
    EXPECT_EQ(some.tau, none.tau);
    EXPECT_EQ(some.color_mean, none.color_mean);
    EXPECT_EQ(some.color_cov, none.color_cov);
  }
}

// A scratch is a worker's own: with fewer workers than threads there are fewer of them, and the same bits.
TEST(RunPass, FewerWorkersThanThreadsChangeNoResult) {
  std::mt19937 random(15);
  const Volume start = random_volume({2, 2, 2}, 0.6, 0.01, 0.4, random);
  const std::vector<SampleNode> nodes = nodes_around(start, 4, 24, 1, random);
  const auto after = [&](int workers) {
    Volume volume = start;
    PassOptions options = calm();
    options.most_workers = workers;
    run_pass(nodes, options, RunContext(3), nullptr, volume);
    return volume;
  };
  const Volume three = after(3);
  for (const int workers : {1, 2}) {
    const Volume fewer = after(workers);
    EXPECT_EQ(fewer.tau, three.tau);
    EXPECT_EQ(fewer.support, three.support);
    EXPECT_EQ(fewer.color_cov, three.color_cov);
  }
  PassOptions options;
  EXPECT_EQ(worker_count(options, RunContext(3)), 3);
  options.most_workers = 2;
  EXPECT_EQ(worker_count(options, RunContext(3)), 2);
}

// What passes leave in the memory that they share says nothing to the next one: whatever was kept, and with
// other samples in between.
TEST(RunPass, SharedMemoryChangesNoResult) {
  std::mt19937 random(6);
  const Volume start = random_volume({2, 2, 2}, 0.6, 0.01, 0.4, random);
  const std::vector<SampleNode> nodes = nodes_around(start, 4, 24, 1, random);
  const std::vector<SampleNode> others = nodes_around(start, 4, 12, 0, random);
  PassOptions options = calm();
  options.kept_color_bytes = 100000;  // of some nodes
  const auto after = [&](PassMemory* memory) {
    Volume volume = start;
    for (const std::vector<SampleNode>& samples : {nodes, others, nodes})
      run_pass(samples, options, RunContext(2), nullptr, volume, nullptr, memory);
    return volume;
  };
  const Volume apart = after(nullptr);
  PassMemory memory;
  for (int round = 0; round < 2; ++round) {
    const Volume shared = after(&memory);
    EXPECT_EQ(shared.tau, apart.tau);
    EXPECT_EQ(shared.support, apart.support);
    EXPECT_EQ(shared.color_mean, apart.color_mean);
    EXPECT_EQ(shared.color_cov, apart.color_cov);
  }
}

// Opaque volumes: rays stop early, so that what they leave out is below SegmentMarch::kNegligible of a ray.
TEST(RunPass, OpaqueVolumesDifferByTheEarlyStopAtMost) {
  std::mt19937 random(10);
  Volume volume = random_volume({2, 1, 2}, 0.7, 0.05, 5, random);
  const std::vector<SampleNode> nodes = nodes_around(volume, 4, 16, 1, random);
  PassOptions options = calm();
  PassTwin twin(volume, options);
  twin.run(nodes);
  run_pass(nodes, options, RunContext(1), nullptr, volume);
  // Up to about 100 rays cross a voxel, over a weight of at least beta = 5.
  EXPECT_LE(difference(volume, twin).tau, 100 * SegmentMarch::kNegligible / 5);
}

}  // namespace
}  // namespace roxel

#include "roxel/infer/update.h"

#include <gtest/gtest.h>

#include <cmath>

#include "roxel/infer/infer_fixture.h"

namespace roxel {
namespace {

using fixture::slot_at;

/// All voxels of 2 x 2 x 2 bricks for which `exists`, of opacity `alpha(x, y, z)`.
template <class Exists, class Alpha>
Volume volume_where(Exists&& exists, Alpha&& alpha) {
  Topology topology(LatticeFrame{{0, 0, 0}, 1, {2, 2, 2}});
  for (int z = 0; z < 16; ++z)
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 16; ++x)
        if (exists(x, y, z)) topology.insert({x, y, z});
  Volume volume({topology});
  for (int z = 0; z < 16; ++z)
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 16; ++x)
        if (const std::uint32_t slot = slot_at(volume, x, y, z); slot != kNoSlot)
          volume.tau[slot] = tau_from_alpha(static_cast<float>(alpha(x, y, z)));
  return volume;
}

const auto everywhere = [](int, int, int) { return true; };

constexpr double kAlpha0 = 0.02;
constexpr double kLambda = 0.9;

float prior_at(const Volume& volume, int x, int y, int z, double lambda = kLambda) {
  return prior_opacity_field(volume, {kAlpha0, 5, lambda}, 1)[slot_at(volume, x, y, z)];
}

double mixed(double sheet) { return (1 - kLambda) * kAlpha0 + kLambda * sheet; }

// A wall x = 7 with opacity 0.6: its voxels have 8 opaque neighbours in the wall's plane; a voxel beside it
// has 3 of 8 in the planes that cut the wall along a row. Voxels 7 and 8 lie in different bricks.
TEST(SheetPrior, KnowsAWallAcrossBricks) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto along = [axis](int x, int y, int z) { return axis == 0 ? x : axis == 1 ? y : z; };
    const Volume volume =
        volume_where(everywhere, [&](int x, int y, int z) { return along(x, y, z) == 7 ? 0.6 : 0; });
    const auto at = [&](int depth) {
      return axis == 0   ? prior_at(volume, depth, 7, 8)
             : axis == 1 ? prior_at(volume, 8, depth, 7)
                         : prior_at(volume, 7, 8, depth);
    };
    EXPECT_NEAR(at(7), mixed(0.6), 1e-6);
    EXPECT_NEAR(at(8), mixed(3 * 0.6 / 8), 1e-6);
    EXPECT_NEAR(at(6), mixed(3 * 0.6 / 8), 1e-6);
    EXPECT_NEAR(at(9), mixed(0), 1e-6);
  }
}

// Walls that lie askew are sheets as good as those along the axes: every plane n x = c with n in {-1, 0,
// 1}^3.
TEST(SheetPrior, KnowsWallsOfAllThirteenDirections) {
  for (int normal = 0; normal < 13; ++normal) {
    const Eigen::Vector3i n(normal % 3 - 1, normal / 3 % 3 - 1, normal / 9 - 1);
    const int through = n.dot(Eigen::Vector3i(7, 8, 7));
    const Volume volume = volume_where(everywhere, [&](int x, int y, int z) {
      return n.dot(Eigen::Vector3i(x, y, z)) == through ? 0.6 : 0;
    });
    EXPECT_NEAR(prior_at(volume, 7, 8, 7), mixed(0.6), 1e-6) << n.transpose();
  }
}

TEST(SheetPrior, AVoxelDoesNotCountItself) {
  const Volume volume =
      volume_where(everywhere, [](int x, int y, int z) { return x == 7 && y == 7 && z == 7 ? 0.9 : 0; });
  EXPECT_NEAR(prior_at(volume, 7, 7, 7), mixed(0), 1e-6);
  EXPECT_NEAR(prior_at(volume, 8, 7, 7), mixed(0.9 / 8), 1e-6);
  EXPECT_NEAR(prior_at(volume, 8, 8, 7), mixed(0.9 / 6), 1e-6);  // in a plane like (1, -1, 1): of 6
  EXPECT_NEAR(prior_at(volume, 8, 8, 8), mixed(0.9 / 8), 1e-6);
  EXPECT_NEAR(prior_at(volume, 9, 7, 7), mixed(0), 1e-6);
}

TEST(SheetPrior, TakesTheBestPlane) {
  // (7, 7, 7) lies in three walls; beside the crossing, at (9, 7, 7), the stronger of two counts.
  const auto alpha = [](int x, int y, int z) { return x == 7 ? 0.3 : y == 7 ? 0.5 : z == 7 ? 0.1 : 0; };
  const Volume volume = volume_where(everywhere, alpha);
  EXPECT_NEAR(prior_at(volume, 9, 7, 9), mixed(0.5), 1e-6);
  EXPECT_NEAR(prior_at(volume, 9, 9, 7), mixed(0.1), 1e-6);
  EXPECT_NEAR(prior_at(volume, 7, 9, 9), mixed(0.3), 1e-6);
}

TEST(SheetPrior, AbsentNeighboursCountZero) {
  const auto wall = [](int x, int, int) { return x == 7; };
  const Volume alone = volume_where(wall, [](int, int, int) { return 0.6; });
  EXPECT_NEAR(prior_at(alone, 7, 5, 5), mixed(0.6), 1e-6);
  EXPECT_NEAR(prior_at(alone, 7, 0, 5), mixed(5 * 0.6 / 8), 1e-6);  // at the box's face
  EXPECT_NEAR(prior_at(alone, 7, 0, 0), mixed(3 * 0.6 / 8), 1e-6);
  const Volume half =
      volume_where([](int x, int y, int) { return x == 7 && y < 8; }, [](int, int, int) { return 0.6; });
  EXPECT_NEAR(prior_at(half, 7, 7, 5), mixed(5 * 0.6 / 8), 1e-6);
}

TEST(SheetPrior, LambdaZeroIsAlphaZeroAndLambdaOneIsTheNeighbours) {
  const Volume volume = volume_where(everywhere, [](int x, int, int) { return x == 7 ? 0.6 : 0; });
  EXPECT_FLOAT_EQ(prior_at(volume, 7, 5, 5, 0), kAlpha0);
  EXPECT_NEAR(prior_at(volume, 7, 5, 5, 1), 0.6, 1e-6);
  EXPECT_NEAR(prior_at(volume, 10, 5, 5, 1), 0, 1e-6);
}

// 0.6 against 0.45: odds of 1.5 over 0.818.
TEST(SheetPrior, SharpnessDrivesOpacitiesApart) {
  const Volume volume = volume_where(everywhere, [](int x, int, int) { return x == 7 ? 0.6 : 0; });
  const auto at = [&](int x, double sharpness) {
    return prior_opacity_field(volume, {kAlpha0, 5, kLambda, sharpness}, 1)[slot_at(volume, x, 7, 8)];
  };
  EXPECT_EQ(at(7, 1), prior_at(volume, 7, 7, 8));
  const double odds = 1.5 / (0.45 / 0.55), beside = 0.225 / 0.775 / (0.45 / 0.55);
  EXPECT_NEAR(at(7, 2), mixed(odds * odds / (1 + odds * odds)), 1e-6);
  EXPECT_NEAR(at(7, 3), mixed(std::pow(odds, 3) / (1 + std::pow(odds, 3))), 1e-6);
  EXPECT_NEAR(at(8, 2), mixed(beside * beside / (1 + beside * beside)), 1e-6);
  EXPECT_NEAR(at(9, 2), mixed(0), 1e-6);
  const Volume solid = volume_where(everywhere, [](int, int, int) { return 1 - 1e-7; });
  EXPECT_NEAR(prior_opacity_field(solid, {kAlpha0, 5, kLambda, 2}, 1)[slot_at(solid, 7, 7, 8)], mixed(1),
              1e-5);
}

TEST(SheetPrior, DoesNotDependOnThreads) {
  std::mt19937 random(1);
  const Volume volume = fixture::random_volume({4, 4, 4}, 0.5, 0.01, 3, random);
  EXPECT_EQ(prior_opacity_field(volume, {}, 1), prior_opacity_field(volume, {}, 4));
}

/// One row of voxels and sums for them.
struct Row {
  Volume volume;
  Totals totals;
  explicit Row(int count) : volume(make(count)), totals(count) {}
  static Volume make(int count) {
    Topology topology(LatticeFrame{{0, 0, 0}, 1, {2, 1, 1}});
    for (int i = 0; i < count; ++i) topology.insert({i, 0, 0});
    return Volume({topology});
  }
  void set(int slot, double hits, double exposure, double looked) {
    totals.opacity[slot] = {std::llrint(hits * kOpacityUnit), std::llrint(exposure * kOpacityUnit),
                            std::llrint(looked * kOpacityUnit)};
  }
};

TEST(UpdateOpacity, PosteriorIsHitsAndPriorOverExposureAndStrength) {
  Row row(3);
  row.set(0, 2, 4, 1);
  row.set(1, 0, 3, 1);
  row.set(2, 0, 0, 0);
  update_opacity(UpdateRule::kPosterior, row.totals, {0.1f, 0.2f, 0.3f}, 5, 1, row.volume);
  EXPECT_NEAR(row.volume.tau[0], (2 + 5 * -std::log(0.9)) / (4 + 5), 1e-5);
  EXPECT_NEAR(row.volume.tau[1], 5 * -std::log(0.8) / (3 + 5), 1e-5);
  EXPECT_NEAR(row.volume.tau[2], -std::log(0.7), 1e-5);  // nothing known: the prior's mode
  EXPECT_FLOAT_EQ(row.volume.support[0][0], 2);
  EXPECT_FLOAT_EQ(row.volume.support[0][1], 4);
}

TEST(UpdateOpacity, WithoutPriorOrEvidenceAVoxelFallsBackToThePriorsMode) {
  for (const UpdateRule rule : {UpdateRule::kPosterior, UpdateRule::kRoxels}) {
    Row row(2);
    row.set(1, 1, 0.5, 1);
    update_opacity(rule, row.totals, {0.02f, 0.02f}, 0, 1, row.volume);
    EXPECT_NEAR(alpha_from_tau(row.volume.tau[0]), 0.02, 1e-6);
    EXPECT_NEAR(row.volume.tau[1], rule == UpdateRule::kPosterior ? 2 : std::log(2.0), 1e-5);
  }
}

TEST(UpdateOpacity, TauStaysFinite) {
  Row row(3);
  row.set(0, 1000, 1e-5, 1);
  row.set(1, 1e6, 1, 1);
  update_opacity(UpdateRule::kPosterior, row.totals, {0.02f, 0.02f, 1.0f}, 0, 1, row.volume);
  for (const float tau : row.volume.tau) {
    EXPECT_TRUE(std::isfinite(tau));
    EXPECT_LE(tau, 16);
    EXPECT_GT(tau, 13);
  }
}

TEST(UpdateOpacity, ConfidenceCountsPlacesThatLooked) {
  Row row(4);
  const double looked[4] = {0, 0.5, 2, 8};
  for (int i = 0; i < 4; ++i) row.set(i, 0, 1, looked[i]);
  update_opacity(UpdateRule::kPosterior, row.totals, std::vector<float>(4, 0.02f), 5, 1, row.volume);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(row.volume.confidence[i], looked[i] / (looked[i] + 2), 1e-6);
}

TEST(UpdateOpacity, ReportsTheMeanChangeOverVoxelsLookedAt) {
  Row row(3);
  row.volume.tau = {0, 0, 0};
  row.set(0, 1, 2, 1);
  row.set(1, 0, 2, 1);
  const UpdateReport report =
      update_opacity(UpdateRule::kPosterior, row.totals, {0.5f, 0.5f, 0.5f}, 0, 1, row.volume);
  const double first = 1 - std::exp(-0.5), unseen = 0.5;
  EXPECT_NEAR(report.mean_opacity_change, first / 2, 1e-6);
  EXPECT_NEAR(report.mean_opacity, (first + unseen) / 3, 1e-6);
}

TEST(UpdateColor, SetsWhatIsSeenAndKeepsTheRest) {
  Row row(2);
  row.volume.color_mean[1] = {7, 8, 9};
  row.volume.color_weight[1] = 3;
  const std::int64_t half = 1 << 23;  // weight 1/2
  row.totals.color[0] = {half, 10 * half, 20 * half, 0, 150 * half, 410 * half, 0, 200 * half, 0, 0};
  update_color(row.totals.color, 1, row.volume);
  EXPECT_FLOAT_EQ(row.volume.color_weight[0], 0.5f);
  EXPECT_FLOAT_EQ(row.volume.color_mean[0][0], 10);
  EXPECT_FLOAT_EQ(row.volume.color_mean[0][1], 20);
  const std::array<float, 6> cov = row.volume.color_cov[0].unpacked();
  EXPECT_NEAR(cov[0], 50, 0.05);
  EXPECT_NEAR(cov[1], 10, 0.01);
  EXPECT_NEAR(cov[3], 0, 1e-4);
  EXPECT_FLOAT_EQ(row.volume.color_mean[1][2], 9);
  EXPECT_FLOAT_EQ(row.volume.color_weight[1], 3);
}

// Two voxels on their way up from the same opacity: one that only its prior moves, one that only rays move.
TEST(UpdateOpacity, HurriesWhatRaysMoveAndNotWhatThePriorMoves) {
  Row row(2);
  row.volume.tau = {0.1f, 0.1f};
  row.set(0, 0, 0, 0);
  row.set(1, 200, 1000, 1);
  Acceleration acceleration(2, 8);
  const float prior = static_cast<float>(-std::expm1(-0.2));
  update_opacity(UpdateRule::kPosterior, row.totals, {prior, prior}, 1e-3, 1, row.volume, &acceleration);
  EXPECT_NEAR(row.volume.tau[0], 0.2, 1e-5);  // EM's step
  EXPECT_NEAR(row.volume.tau[1], 0.4, 1e-5);  // twice as long, in log tau
}

}  // namespace
}  // namespace roxel

#include "roxel/depth/gaussian_lattice.h"

#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <chrono>
#include <cmath>
#include <random>

namespace roxel {
namespace {

/// Random evidence with gaps, ties of all strengths, and steps.
GaussianLattice random_lattice(int width, int height, bool steps, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(0, 1);
  GaussianLattice field(width, height);
  if (steps) field.right_step = field.down_step = std::vector<float>(field.mean.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * width + x;
      field.precision[i] = unit(random) < 0.3f ? 0 : 0.2f + 4 * unit(random);
      field.mean[i] = 10 + 5 * unit(random);
      field.right[i] = x + 1 < width ? 3 * unit(random) : 0;
      field.down[i] = y + 1 < height ? 3 * unit(random) : 0;
      if (steps) field.right_step[i] = unit(random) - 0.5f, field.down_step[i] = unit(random) - 0.3f;
    }
  return field;
}

/// The exact means: minimum of sum precision (z - mean)^2 + sum tie (z_b - z_a - step)^2.
Eigen::VectorXd exact_means(const GaussianLattice& field) {
  const int count = field.width * field.height;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right_side = Eigen::VectorXd::Zero(count);
  const auto add_tie = [&](int a, int b, double tie, double step) {
    entries.insert(entries.end(), {{a, a, tie}, {b, b, tie}, {a, b, -tie}, {b, a, -tie}});
    right_side[a] -= tie * step;
    right_side[b] += tie * step;
  };
  for (int y = 0; y < field.height; ++y)
    for (int x = 0; x < field.width; ++x) {
      const int i = y * field.width + x;
      entries.emplace_back(i, i, field.precision[i]);
      right_side[i] += double(field.precision[i]) * field.mean[i];
      const bool steps = !field.right_step.empty();
      if (x + 1 < field.width) add_tie(i, i + 1, field.right[i], steps ? field.right_step[i] : 0.0);
      if (y + 1 < field.height) add_tie(i, i + field.width, field.down[i], steps ? field.down_step[i] : 0.0);
    }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right_side);
}

double largest_difference(const LatticeBeliefs& beliefs, const Eigen::VectorXd& exact) {
  double largest = 0;
  for (std::size_t i = 0; i < beliefs.mean.size(); ++i)
    largest = std::max(largest, std::abs(beliefs.mean[i] - exact[static_cast<int>(i)]));
  return largest;
}

PropagationOptions to_the_end(MessageSchedule schedule) { return {schedule, 2000, 1e-7}; }

TEST(GaussianLattice, BothSchedulesConvergeToTheExactSolution) {
  for (const auto& [width, height] : {std::pair{31, 17}, {16, 24}, {1, 9}, {9, 1}, {2, 2}})
    for (const bool steps : {false, true}) {
      const GaussianLattice field = random_lattice(width, height, steps);
      const Eigen::VectorXd exact = exact_means(field);
      // Floats of about 10 carry 1e-6.
      EXPECT_LT(largest_difference(propagate(field, to_the_end(MessageSchedule::kSynchronous)), exact), 2e-5)
          << width << " x " << height << ", steps " << steps;
      EXPECT_LT(largest_difference(propagate(field, to_the_end(MessageSchedule::kResidual)), exact), 2e-6);
    }
}

/// The formulas of the synchronous schedule as docs/depth.md has them, all messages at once.
LatticeBeliefs plain_synchronous(const GaussianLattice& field, int times) {
  const int w = field.width, h = field.height;
  struct Message {
    double p = 0, h = 0;
  };
  using Inbox = std::vector<std::array<Message, 4>>;  // from left, right, up, down
  const int dx[4] = {-1, 1, 0, 0}, dy[4] = {0, 0, -1, 1};
  Inbox inbox(static_cast<std::size_t>(w) * h);
  for (int time = 0; time < times; ++time) {
    Inbox next(inbox.size());
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x)
        for (int side = 0; side < 4; ++side) {
          const int nx = x + dx[side], ny = y + dy[side];
          if (nx < 0 || ny < 0 || nx >= w || ny >= h) continue;
          const int i = y * w + x, first = side % 2 ? i : ny * w + nx;
          const double tie = side < 2 ? field.right[first] : field.down[first];
          double step = 0;
          if (!field.right_step.empty())
            step = (side < 2 ? field.right_step[first] : field.down_step[first]) * (side % 2 ? 1 : -1);
          double p = field.precision[i], m = p * field.mean[i];
          for (int k = 0; k < 4; ++k)
            if (k != side) p += inbox[i][k].p, m += inbox[i][k].h;
          if (!(p > 0) || !(tie > 0)) continue;
          const double out = 1 / (1 / tie + 1 / p);
          next[ny * w + nx][side ^ 1] = {out, out * (m / p + step)};
        }
    inbox = next;
  }
  LatticeBeliefs beliefs;
  for (std::size_t i = 0; i < inbox.size(); ++i) {
    double p = field.precision[i], m = p * field.mean[i];
    for (const Message& message : inbox[i]) p += message.p, m += message.h;
    beliefs.mean.push_back(static_cast<float>(p > 0 ? m / p : 0));
    beliefs.precision.push_back(static_cast<float>(p));
  }
  return beliefs;
}

TEST(GaussianLattice, ASweepIsTwoStepsOfTheSynchronousSchedule) {
  // Widths on both sides of a line of the cache, which holds 16 columns of one parity.
  for (const auto& [width, height] : {std::pair{13, 10}, {31, 4}, {32, 4}, {33, 4}, {66, 3}, {1, 7}}) {
    const GaussianLattice field = random_lattice(width, height, true, 3);
    for (const int sweeps : {1, 2, 4, 5, 7, 12}) {
      const LatticeBeliefs fast = propagate(field, {MessageSchedule::kSynchronous, sweeps, -1});
      const LatticeBeliefs even = plain_synchronous(field, 2 * sweeps),
                           odd = plain_synchronous(field, 2 * sweeps - 1);
      ASSERT_EQ(fast.sweeps, sweeps);
      for (int y = 0; y < field.height; ++y)
        for (int x = 0; x < field.width; ++x) {
          const int i = y * field.width + x;
          const LatticeBeliefs& twin = (x + y) % 2 ? odd : even;
          EXPECT_NEAR(fast.mean[i], twin.mean[i], 1e-4) << sweeps << " " << x << " " << y;
          EXPECT_NEAR(fast.precision[i], twin.precision[i], 1e-4 * (1 + twin.precision[i]));
        }
    }
  }
}

TEST(GaussianLattice, MovementIsThatOfTheLastSweep) {
  const GaussianLattice field = random_lattice(21, 12, true, 5);
  for (const int sweeps : {2, 3, 5, 6, 8}) {
    const LatticeBeliefs last = propagate(field, {MessageSchedule::kSynchronous, sweeps, 0});
    const LatticeBeliefs before = propagate(field, {MessageSchedule::kSynchronous, sweeps - 1, 0});
    double most = 0;
    for (std::size_t i = 0; i < last.mean.size(); ++i)
      most = std::max(most, std::abs(double(last.mean[i]) - before.mean[i]) * std::sqrt(last.precision[i]));
    EXPECT_GT(most, 1e-3);
    EXPECT_NEAR(last.movement, most, 1e-5) << sweeps;  // floats of about 10, and precisions of about 10
  }
}

TEST(GaussianLattice, OnAChainPrecisionsAreExact) {
  GaussianLattice field(3, 1);
  field.precision = {1, 0, 4};
  field.mean = {2, 0, 7};
  field.right = {2, 5, 0};
  const LatticeBeliefs beliefs = propagate(field, to_the_end(MessageSchedule::kSynchronous));
  // Two observers of the middle: 1 behind 2, and 4 behind 5.
  const double left = 1 / (1 / 1.0 + 1 / 2.0), right = 1 / (1 / 4.0 + 1 / 5.0);
  EXPECT_NEAR(beliefs.precision[1], left + right, 1e-5);
  EXPECT_NEAR(beliefs.mean[1], (2 * left + 7 * right) / (left + right), 1e-5);
}

TEST(GaussianLattice, WithoutTiesEvidenceStays) {
  GaussianLattice field = random_lattice(5, 4, false);
  std::fill(field.right.begin(), field.right.end(), 0.0f);
  std::fill(field.down.begin(), field.down.end(), 0.0f);
  const LatticeBeliefs beliefs = propagate(field, {});
  for (std::size_t i = 0; i < field.mean.size(); ++i) {
    EXPECT_FLOAT_EQ(beliefs.precision[i], field.precision[i]);
    EXPECT_NEAR(beliefs.mean[i], field.precision[i] > 0 ? field.mean[i] : 0, 2e-6);
  }
}

TEST(GaussianLattice, ResidualScheduleSpendsItsMessagesWhereTheyMatter) {
  GaussianLattice field(60, 40);
  std::fill(field.precision.begin(), field.precision.end(), 100.0f);
  for (int y = 0; y < field.height; ++y)
    for (int x = 0; x < field.width; ++x) {
      field.right[y * field.width + x] = x + 1 < field.width ? 1.0f : 0;
      field.down[y * field.width + x] = y + 1 < field.height ? 1.0f : 0;
    }
  field.mean[20 * 60 + 30] = 5;  // the rest agrees already
  const LatticeBeliefs beliefs = propagate(field, {MessageSchedule::kResidual, 100, 1e-3});
  EXPECT_LE(beliefs.movement, 1e-3);
  EXPECT_LE(beliefs.sweeps, 4);
}

TEST(GaussianLattice, CanBeStopped) {
  struct Stop {};
  for (const auto schedule : {MessageSchedule::kSynchronous, MessageSchedule::kResidual})
    EXPECT_THROW(propagate(random_lattice(8, 8, false), {schedule, 10, 0}, [] { throw Stop(); }), Stop);
}

}  // namespace
}  // namespace roxel

#include "roxel/volume/merge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <random>

#include "roxel/base/error.h"

namespace roxel {
namespace {

constexpr double kBeta = 5;

LatticeFrame frame_at(const Eigen::Vector3d& origin, int bricks = 2) {
  return {origin, 0.25, Eigen::Vector3i::Constant(bricks)};
}

// What one ray, or one photograph, has to say about one voxel.
struct Observation {
  int voxel;  // in x, along y = z = 0
  double weight, color[3], r, exposure, looked;
};

// The plain twin: one joint accumulation in doubles, formulas as printed, over voxels (0..15, 0, 0).
Volume accumulated(const std::vector<Observation>& observations, const std::vector<double>& tau_0) {
  Topology topology(frame_at(Eigen::Vector3d::Zero()));
  for (const Observation& o : observations) topology.insert({o.voxel, 0, 0});
  Volume volume({topology});
  for (int i = 0; i < 16; ++i) {
    const std::uint32_t s = volume.index(0).slot({i, 0, 0});
    if (s == kNoSlot) continue;
    double w = 0, r = 0, exposure = 0, n = 0;
    Eigen::Vector3d mu = Eigen::Vector3d::Zero();
    Eigen::Matrix3d cov = Eigen::Matrix3d::Zero();
    for (const Observation& o : observations) {
      if (o.voxel != i) continue;
      w += o.weight, r += o.r, exposure += o.exposure, n += o.looked;
      mu += o.weight * Eigen::Vector3d(o.color);
    }
    mu /= w;
    for (const Observation& o : observations)
      if (o.voxel == i)
        cov += o.weight / w * (Eigen::Vector3d(o.color) - mu) * (Eigen::Vector3d(o.color) - mu).transpose();
    volume.tau[s] = static_cast<float>((r + kBeta * tau_0[i]) / (exposure + kBeta));
    volume.confidence[s] = static_cast<float>(n / (n + 2));
    volume.color_weight[s] = static_cast<float>(w);
    for (int c = 0; c < 3; ++c) volume.color_mean[s][c] = static_cast<float>(mu[c]);
    const Eigen::Matrix3f c = cov.cast<float>();
    volume.color_cov[s] = PackedCovariance({c(0, 0), c(1, 1), c(2, 2), c(0, 1), c(0, 2), c(1, 2)});
    volume.support[s] = {static_cast<float>(r), static_cast<float>(exposure)};
  }
  return volume;
}

std::vector<Observation> random_observations(std::mt19937& random, int count) {
  std::uniform_real_distribution<double> unit(0.01, 1);
  std::vector<Observation> all;
  for (int i = 0; i < count; ++i)
    all.push_back({static_cast<int>(random() % 16),
                   unit(random),
                   {100 * unit(random), 80 * unit(random) - 40, 80 * unit(random) - 40},
                   unit(random),
                   2 * unit(random),
                   unit(random)});
  return all;
}

void expect_near(const Volume& a, const Volume& b) {
  ASSERT_EQ(a.slot_count(), b.slot_count());
  for (std::uint32_t s = 0; s < a.slot_count(); ++s) {
    EXPECT_NEAR(a.tau[s], b.tau[s], 2e-6 * (1 + b.tau[s]));
    EXPECT_NEAR(a.confidence[s], b.confidence[s], 1e-6);
    EXPECT_NEAR(a.color_weight[s], b.color_weight[s], 1e-5);
    EXPECT_NEAR(a.support[s][0], b.support[s][0], 1e-5);
    EXPECT_NEAR(a.support[s][1], b.support[s][1], 1e-5);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(a.color_mean[s][c], b.color_mean[s][c], 1e-4);
    // Both are rounded to three digits, and so were the parts of one of them.
    const std::array<float, 6> one = a.color_cov[s].unpacked(), other = b.color_cov[s].unpacked();
    const float spread = std::max({one[0], one[1], one[2]});
    for (int c = 0; c < 6; ++c) EXPECT_NEAR(one[c], other[c], 5e-3 + 3e-3 * spread);
  }
}

TEST(Merge, GivesTheSumsOfOneJointAccumulation) {
  std::mt19937 random(5);
  for (int round = 0; round < 20; ++round) {
    const std::vector<Observation> first = random_observations(random, 40),
                                   second = random_observations(random, 25);
    std::vector<Observation> both = first;
    both.insert(both.end(), second.begin(), second.end());
    const std::vector<double> flat(16, -std::log1p(-0.02));
    const Volume a = accumulated(first, flat), b = accumulated(second, flat), joint = accumulated(both, flat);
    expect_near(merge({&a, &b}, {.prior_strength = kBeta, .prior_opacity = 0.02}), joint);
    expect_near(merge({&b, &a}, {.prior_strength = kBeta, .prior_opacity = 0.02}), joint);
  }
}

TEST(Merge, FindsThePriorOfEachVoxelInTheVolumes) {
  std::mt19937 random(6);
  std::vector<double> sheet(16);
  for (int i = 0; i < 16; ++i) sheet[i] = 0.02 + 0.1 * i;
  const std::vector<Observation> first = random_observations(random, 40),
                                 second = random_observations(random, 40);
  std::vector<Observation> both = first;
  both.insert(both.end(), second.begin(), second.end());
  const Volume a = accumulated(first, sheet), b = accumulated(second, sheet);
  expect_near(merge({&a, &b}, {.prior_strength = kBeta}), accumulated(both, sheet));
}

TEST(Merge, RoxelsOpacityIsTheMeanWeightedByHits) {
  const std::vector<double> none(16, 0);
  Volume a = accumulated({{3, 1, {0, 0, 0}, 2.0, 1.0, 1}}, none),
         b = accumulated({{3, 1, {0, 0, 0}, 1.0, 0.8, 1}}, none);
  EXPECT_NEAR(alpha_from_tau(merge({&a, &b}, {.rule = SupportRule::kRoxels}).tau[0]), 1.8 / 3.0, 1e-6);
  a.support[0] = b.support[0] = {0, 0};
  a.tau[0] = b.tau[0] = 0.25f;
  EXPECT_FLOAT_EQ(merge({&a, &b}, {.rule = SupportRule::kRoxels}).tau[0], 0.25f);
}

// Every channel of every slot different.
Volume painted(const Topology& topology, float salt) {
  Volume volume({topology});
  for (std::uint32_t s = 0; s < volume.slot_count(); ++s) {
    const float x = salt + s;
    volume.tau[s] = x / 100;
    volume.confidence[s] = 1 - 1 / (1 + x);
    volume.color_weight[s] = x;
    volume.color_mean[s] = {x, x + 1, x + 2};
    volume.color_cov[s] = PackedCovariance({x, x, x, 1, 2, 3});
    volume.support[s] = {x, 2 * x};
  }
  return volume;
}

RC_GTEST_PROP(Merge, OfVolumesWithoutCommonVoxelsIsACopy, ()) {
  // The second box starts a whole number of voxels away, on the first one's brick planes or not.
  const Eigen::Vector3i offset = *rc::gen::element(Eigen::Vector3i(16, 0, 0), Eigen::Vector3i(-13, 5, 3));
  const LatticeFrame left = frame_at({-3, 1, 2}),
                     right = frame_at(left.origin + 0.25 * offset.cast<double>());
  Topology in_left(left), in_right(right);
  for (int c : *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 4096)))
    in_left.insert({c % 16, c / 16 % 16, c / 256});
  for (int c : *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 4096))) {
    const Eigen::Vector3i ijk(c % 16, c / 16 % 16, c / 256);
    if (!in_left.contains(ijk + offset)) in_right.insert(ijk);
  }
  const Volume a = painted(in_left, 1), b = painted(in_right, 5000);
  const Volume merged = merge({&a, &b}, {});
  RC_ASSERT(merged.slot_count() == a.slot_count() + b.slot_count());
  RC_ASSERT(merged.index(0).frame().box().contains(left.box()));
  RC_ASSERT(merged.index(0).frame().box().contains(right.box()));
  for (const Volume* v : {&a, &b}) {
    const LatticeFrame& frame = v->index(0).frame();
    const Eigen::Vector3d shift = (frame.origin - merged.index(0).frame().origin) / 0.25;
    for (int c = 0; c < 4096; ++c) {
      const Eigen::Vector3i ijk(c % 16, c / 16 % 16, c / 256);
      const std::uint32_t s = v->index(0).slot(ijk);
      if (s == kNoSlot) continue;
      const std::uint32_t t = merged.index(0).slot(ijk + shift.array().round().matrix().cast<int>());
      RC_ASSERT(t != kNoSlot);
      RC_ASSERT(merged.tau[t] == v->tau[s] && merged.confidence[t] == v->confidence[s]);
      RC_ASSERT(merged.color_weight[t] == v->color_weight[s] && merged.color_mean[t] == v->color_mean[s]);
      RC_ASSERT(merged.color_cov[t] == v->color_cov[s] && merged.support[t] == v->support[s]);
    }
  }
}

std::vector<Topology> with_surround() {
  const auto frames = nested_frames({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(32)}, 1, 1);
  std::vector<Topology> lattices{Topology(frames[0]), Topology(frames[1])};
  lattices[0].insert({3, 3, 3});
  lattices[1].insert({0, 0, 0});
  return lattices;
}

TEST(Merge, KeepsSurroundWhereTheBoxesAreTheSame) {
  const Volume a(with_surround()), b(std::vector<Topology>{with_surround()[0]});
  EXPECT_EQ(merge({&b, &a}, {}).lattice_count(), 2);
  EXPECT_EQ(merge({&b, &a}, {}).slot_count(), 2u);
}

TEST(Merge, LeavesSurroundOutWhereTheBoxesDiffer) {
  const Volume a(with_surround());
  LatticeFrame shifted = a.index(0).frame();
  shifted.origin.x() += 8;
  const Volume b(std::vector<Topology>{Topology(shifted)});
  const Volume merged = merge({&a, &b}, {});
  EXPECT_EQ(merged.lattice_count(), 1);
  EXPECT_EQ(merged.index(0).frame().size_in_bricks, Eigen::Vector3i(5, 4, 4));
}

TEST(Merge, RefusesVolumesThatDoNotFit) {
  const Volume a(std::vector<Topology>{Topology(frame_at(Eigen::Vector3d::Zero()))});
  LatticeFrame half = frame_at({0.125, 0, 0}), coarse = frame_at(Eigen::Vector3d::Zero());
  coarse.voxel_size = 0.5;
  for (const LatticeFrame& frame : {half, coarse}) {
    const Volume b(std::vector<Topology>{Topology(frame)});
    try {
      merge({&a, &b}, {});
      FAIL();
    } catch (const InvalidInput& e) {
      EXPECT_THAT(e.what(), testing::HasSubstr("volume 2: found voxel"));
    }
  }
}

TEST(Merge, NeverDependsOnTheNumberOfThreads) {
  std::mt19937 random(9);
  Topology box(frame_at(Eigen::Vector3d::Zero(), 8)), other(frame_at(Eigen::Vector3d::Zero(), 8));
  for (int i = 0; i < 20000; ++i) {
    box.insert(Eigen::Vector3i(random() % 64, random() % 64, random() % 64));
    other.insert(Eigen::Vector3i(random() % 64, random() % 64, random() % 64));
  }
  const Volume a = painted(box, 1), b = painted(other, 7);
  const Volume one = merge({&a, &b}, {}, 1), four = merge({&a, &b}, {}, 4);
  EXPECT_EQ(one.tau, four.tau);
  EXPECT_EQ(one.color_cov, four.color_cov);
}

TEST(Merge, OfNothingIsNothing) {
  const Volume empty;
  EXPECT_EQ(merge({}, {}).lattice_count(), 0);
  EXPECT_EQ(merge({&empty}, {}).lattice_count(), 0);
}

}  // namespace
}  // namespace roxel

#include "roxel/volume/packed_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

namespace roxel {
namespace {

std::array<float, 6> in_order(const Eigen::Matrix3f& m) {
  return {m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2)};
}

TEST(PackedCovariance, KeepsThreeDigitsAndPacksAgainToTheSameBits) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> exponent(-6, 6);
  for (int trial = 0; trial < 2000; ++trial) {
    Eigen::Matrix3f root = Eigen::Matrix3f::NullaryExpr([&] { return normal(random); });
    if (trial % 3 == 0) root.col(2).setZero();  // of low rank, as few colours make it
    if (trial % 9 == 0) root.col(1).setZero();
    root *= std::pow(10.0f, exponent(random) / 2);
    const std::array<float, 6> exact = in_order(root * root.transpose());
    const PackedCovariance packed(exact);
    const std::array<float, 6> kept = packed.unpacked();
    static constexpr int kFirst[6] = {0, 1, 2, 0, 0, 1}, kSecond[6] = {0, 1, 2, 1, 2, 2};
    for (int c = 0; c < 6; ++c) {
      const float scale = std::sqrt(exact[kFirst[c]] * exact[kSecond[c]]);
      EXPECT_NEAR(kept[c], exact[c], 1.1e-3f * scale) << trial << " " << c;
    }
    EXPECT_EQ(PackedCovariance(kept), packed) << trial;
  }
}

TEST(PackedCovariance, StaysWithinWhatItCanHold) {
  const std::array<float, 6> none{};
  EXPECT_EQ(PackedCovariance().unpacked(), none);
  EXPECT_EQ(PackedCovariance(none), PackedCovariance());
  // No variance, no covariance; none below zero.
  EXPECT_EQ(PackedCovariance({0, -1, 4, 3, 2, 1}).unpacked(), (std::array<float, 6>{0, 0, 4, 0, 0, 0}));
  // Larger than half floats: the largest of them.
  EXPECT_EQ(PackedCovariance({1e12f, 1, 1, 0, 0, 0}).unpacked()[0], 65504.0f * 65504.0f);
  // Beyond a correlation of 1.
  EXPECT_EQ(PackedCovariance({4, 9, 1, 100, -100, 0}).unpacked(), (std::array<float, 6>{4, 9, 1, 6, -2, 0}));
}

}  // namespace
}  // namespace roxel

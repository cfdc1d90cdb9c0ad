#include "roxel/depth/pixel_plane.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

namespace roxel {
namespace {

constexpr double kFocal = 90;

/// What fit_planes does, as it is written in docs/depth.md: one pixel at a time, in double.
Eigen::Vector2d slopes_at(const Image& depth, const Image& variance, int radius, int x, int y) {
  const double z = *depth.pixel(x, y), w0 = 1 / z;
  Eigen::Vector3d plane(w0, 0, 0);
  for (int round = 0; round < 3; ++round) {
    Eigen::Matrix<double, 3, 4> sums = Eigen::Matrix<double, 3, 4>::Zero();
    for (int dy = -radius; dy <= radius; ++dy)
      for (int dx = -radius; dx <= radius; ++dx) {
        if (x + dx < 0 || y + dy < 0 || x + dx >= depth.width() || y + dy >= depth.height()) continue;
        const double zn = *depth.pixel(x + dx, y + dy);
        if (!(zn > 0)) continue;
        const Eigen::Vector3d at(1, dx, dy);
        const double both = *variance.pixel(x, y) + *variance.pixel(x + dx, y + dy);
        const double steep = round == 0 ? 3 * std::hypot(dx, dy) * z / kFocal : 0;
        const double off = zn - 1 / plane.dot(at);
        const double gap = off * off / (2.5 * 2.5 * (both + steep * steep));
        if (gap > 4) continue;
        const double weight = 1 / ((1 + gap * gap) * both);
        sums.leftCols<3>() += weight * at * at.transpose();
        sums.col(3) += weight * at / zn;
      }
    sums /= sums(0, 0);
    // Means taken off, slopes shrink to 0 where neighbours do not span them.
    const Eigen::Vector2d mean = sums.block<2, 1>(1, 0);
    const Eigen::Matrix2d spread =
        sums.block<2, 2>(1, 1) - mean * mean.transpose() + 0.02 * Eigen::Matrix2d::Identity();
    const Eigen::Vector2d slopes = spread.inverse() * (sums.block<2, 1>(1, 3) - mean * sums(0, 3));
    plane << sums(0, 3) - slopes.dot(mean), slopes;
  }
  return plane.tail<2>();
}

/// Two slanted walls one behind the other, with noise and holes; wider than what is worked on at a time.
class Walls {
 public:
  Walls() {
    std::mt19937 random(5);
    std::normal_distribution<float> noise(0, 1);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const float w = (x < 75 ? 0.25f : 0.5f) + 1e-3f * x - 5e-4f * y;
        const float sigma = 0.01f + 0.01f * static_cast<float>(random() % 4);
        *depth.pixel(x, y) = random() % 9 == 0 ? 0 : 1 / w + sigma * noise(random);
        *variance.pixel(x, y) = sigma * sigma;
      }
  }
  static constexpr int kWidth = 150, kHeight = 21;
  Image depth{kWidth, kHeight, 1}, variance{kWidth, kHeight, 1};
};

TEST(FitPlanes, AreThoseOfTheFormulas) {
  const Walls walls;
  for (const int radius : {2, 5}) {
    const PlaneMap map = fit_planes(walls.depth, walls.variance, kFocal, radius);
    for (int y = 0; y < Walls::kHeight; ++y)
      for (int x = 0; x < Walls::kWidth; ++x) {
        const float z = *walls.depth.pixel(x, y);
        const PixelPlane& plane = map.at(x, y);
        if (!(z > 0)) {
          EXPECT_TRUE(plane.empty());
          continue;
        }
        const Eigen::Vector2d expected = slopes_at(walls.depth, walls.variance, radius, x, y);
        EXPECT_FLOAT_EQ(plane.w, 1 / z);
        EXPECT_NEAR(plane.wu, expected.x(), 2e-6) << x << " " << y;
        EXPECT_NEAR(plane.wv, expected.y(), 2e-6) << x << " " << y;
      }
  }
}

TEST(FitPlanes, StopAtGaps) {
  const Walls walls;
  const PlaneMap map = fit_planes(walls.depth, walls.variance, 10 * kFocal, 6);
  for (const int x : {5, 72, 74, 75, 77, 140}) {
    EXPECT_NEAR(map.at(x, 11).wu, 1e-3, 7e-4) << x;
    EXPECT_NEAR(map.at(x, 11).wv, -5e-4, 7e-4) << x;
  }
}

TEST(FitPlanes, LonePixelsFaceTheCamera) {
  Image depth(9, 9, 1), variance(9, 9, 1, 0.01f);
  *depth.pixel(4, 4) = 2;
  const PlaneMap map = fit_planes(depth, variance, kFocal, 3);
  EXPECT_EQ(map.at(4, 4).w, 0.5f);
  EXPECT_EQ(map.at(4, 4).wu, 0);
  EXPECT_EQ(map.at(4, 4).wv, 0);
  EXPECT_TRUE(map.at(3, 4).empty());
}

}  // namespace
}  // namespace roxel

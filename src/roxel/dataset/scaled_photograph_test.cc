#include "roxel/dataset/scaled_photograph.h"

#include <gtest/gtest.h>

namespace roxel {
namespace {

TEST(ScaledCamera, PutsPointsAtTheSamePlaceOfTheImage) {
  PinholeCamera camera;
  camera.intrinsics = {73, 57, 60, 61, 35, 29, 0.5};
  const PinholeCamera half = scaled(camera, 2);
  EXPECT_EQ(half.intrinsics.width, 36);
  EXPECT_EQ(half.intrinsics.height, 28);
  const Eigen::Vector3d x(0.3, 0.2, 4), large = camera.project(x), small = half.project(x);
  EXPECT_NEAR(small.x(), large.x() / 2, 1e-12);
  EXPECT_NEAR(small.y(), large.y() / 2, 1e-12);
}

TEST(ScaledPhotograph, HoldsMeansAndIsValidWhereAllOfASquareIs) {
  Photograph photo;
  photo.rgb = Image(5, 4, 3);
  photo.valid = Mask(5, 4);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 5; ++x)
      for (int c = 0; c < 3; ++c) photo.rgb.pixel(x, y)[c] = static_cast<float>(x + 10 * y + 100 * c);
  photo.valid.at(3, 1) = 0;
  const Photograph half = scaled(photo, 2);
  ASSERT_EQ(half.rgb.width(), 2);  // what is left over is cut off
  ASSERT_EQ(half.rgb.height(), 2);
  for (int c = 0; c < 3; ++c) {
    EXPECT_FLOAT_EQ(half.rgb.pixel(0, 0)[c], 5.5f + 100 * c);
    EXPECT_FLOAT_EQ(half.rgb.pixel(1, 1)[c], 27.5f + 100 * c);
  }
  EXPECT_EQ(half.valid.at(0, 0), 255);
  EXPECT_EQ(half.valid.at(1, 0), 0);
}

TEST(ScaledMask, HoldsMeans) {
  Mask mask(5, 4, 0);
  for (int x = 0; x < 3; ++x) mask.at(x, 0) = 255;
  const Mask half = scaled(mask, 2);
  ASSERT_EQ(half.width(), 2);
  ASSERT_EQ(half.height(), 2);
  EXPECT_EQ(half.at(0, 0), 128);
  EXPECT_EQ(half.at(1, 0), 64);
  EXPECT_EQ(half.at(0, 1), 0);
  EXPECT_EQ(scaled(mask, 1).data(), mask.data());
  EXPECT_TRUE(scaled(Mask(), 2).empty());
}

TEST(EnlargedMask, IsBilinearAndAsLargeAsTheOther) {
  Mask mask(2, 1, 0);
  mask.at(1, 0) = 200;
  const Mask twice = enlarged(mask, 2, 5, 2);
  ASSERT_EQ(twice.width(), 5);
  ASSERT_EQ(twice.height(), 2);
  for (const int y : {0, 1}) {
    const int expected[] = {0, 50, 150, 200, 200};
    for (int x = 0; x < 5; ++x) EXPECT_EQ(twice.at(x, y), expected[x]) << x;
  }
  EXPECT_EQ(enlarged(mask, 1, 2, 1).data(), mask.data());
}

}  // namespace
}  // namespace roxel

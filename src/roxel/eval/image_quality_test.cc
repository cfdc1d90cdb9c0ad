#include "roxel/eval/image_quality.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace roxel {
namespace {

Image pattern(int width, int height) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = 0.5f + 0.4f * std::sin(0.7f * x + 1.1f * y + c);
  return image;
}

TEST(ImageQuality, OfIdenticalPicturesIsPerfect) {
  const Image image = pattern(20, 16);
  const ImageQuality same = image_quality(image, image, {});
  EXPECT_EQ(same.pixels, 320);
  EXPECT_EQ(same.windows, 10 * 6);
  EXPECT_EQ(same.rms(), 0);
  EXPECT_NEAR(same.ssim(), 1, 1e-12);
  EXPECT_EQ(same.psnr(), std::numeric_limits<double>::infinity());
}

TEST(ImageQuality, OfFlatPicturesByHand) {
  // No variance: the similarity is that of the means, (2 a b + C1) / (a^2 + b^2 + C1).
  const Image a(11, 11, 3, 0.5f), b(11, 11, 3, 0.25f);
  const ImageQuality flat = image_quality(a, b, {});
  EXPECT_EQ(flat.windows, 1);
  EXPECT_NEAR(flat.ssim(), (2 * 0.125 + 1e-4) / (0.25 + 0.0625 + 1e-4), 1e-9);
  EXPECT_NEAR(flat.rms(1), 0.25, 1e-12);
  EXPECT_NEAR(flat.psnr(), 20 * std::log10(4.0), 1e-9);
}

TEST(ImageQuality, OfAnInvertedRampByHand) {
  // b = 1 - a about the mean 1/2: covariance is minus the variance. A ramp of 0.02 a column has the variance
  // 0.02^2 times that of the window's columns.
  Image a(11, 11, 3), b(11, 11, 3);
  for (int y = 0; y < 11; ++y)
    for (int x = 0; x < 11; ++x)
      for (int c = 0; c < 3; ++c) {
        a.pixel(x, y)[c] = 0.5f + 0.02f * static_cast<float>(x - 5);
        b.pixel(x, y)[c] = 0.5f - 0.02f * static_cast<float>(x - 5);
      }
  double weight = 0, squares = 0;
  for (int i = -5; i <= 5; ++i) {
    weight += std::exp(-i * i / 4.5);
    squares += i * i * std::exp(-i * i / 4.5);
  }
  const double variance = 0.0004 * squares / weight;
  EXPECT_NEAR(image_quality(a, b, {}).ssim(), (-2 * variance + 9e-4) / (2 * variance + 9e-4), 1e-6);
}

TEST(ImageQuality, ChannelsAreApartAndTheMaskCounts) {
  const Image a(12, 11, 3, 0.5f);
  Image b = a;
  Mask left(12, 11, 0);
  for (int y = 0; y < 11; ++y)
    for (int x = 0; x < 6; ++x) {
      left.at(x, y) = 255;
      b.pixel(x, y)[2] = 0.7f;
    }
  const ImageQuality counted = image_quality(a, b, left), all = image_quality(a, b, {});
  EXPECT_EQ(counted.pixels, 66);
  EXPECT_EQ(counted.windows, 1);
  EXPECT_EQ(all.windows, 2);
  EXPECT_EQ(counted.rms(0), 0);
  EXPECT_NEAR(counted.rms(2), 0.2, 1e-6);
  EXPECT_NEAR(all.rms(2), 0.2 / std::sqrt(2), 1e-6);
  EXPECT_NEAR(counted.rms(), 0.2 / std::sqrt(3), 1e-6);
}

TEST(ImageQuality, ViewsAddUp) {
  const Image a = pattern(14, 13), b(14, 13, 3, 0.5f);
  ImageQuality twice = image_quality(a, b, {});
  const ImageQuality once = twice;
  twice.add(image_quality(a, a, {}));
  EXPECT_EQ(twice.pixels, 2 * once.pixels);
  EXPECT_NEAR(twice.rms(), once.rms() / std::sqrt(2), 1e-12);
  EXPECT_NEAR(twice.ssim(), (once.ssim() + 1) / 2, 1e-12);
}

TEST(ImageQuality, RefusesPicturesOfDifferentSizes) {
  EXPECT_THROW(image_quality(Image(4, 4, 3), Image(4, 5, 3), {}), std::logic_error);
}

}  // namespace
}  // namespace roxel

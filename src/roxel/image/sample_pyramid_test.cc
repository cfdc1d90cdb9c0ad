#include "roxel/image/sample_pyramid.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace roxel {
namespace {

struct Photo {
  Image samples;
  Mask valid;
  Mask foreground;
};

enum class Masks { kNone, kValid, kForeground, kBoth };

/// Noise of Luv's range; masks of blocks of 0 and 255 with random bytes between, so that whole regions are
/// empty.
Photo random_photo(int width, int height, Masks masks, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<float> value(-100, 100);
  Photo photo{Image(width, height, 3), {}, {}};
  for (float& v : photo.samples.data()) v = value(rng);
  const auto draw_mask = [&] {
    Mask mask(width, height);
    const unsigned salt = rng();
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const unsigned block = (x / 5 * 7 + y / 5 * 13 + salt) % 3;
        mask.at(x, y) = block == 0 ? 0 : block == 1 ? 255 : rng() % 256;
      }
    return mask;
  };
  if (masks == Masks::kValid || masks == Masks::kBoth) photo.valid = draw_mask();
  if (masks == Masks::kForeground || masks == Masks::kBoth) photo.foreground = draw_mask();
  return photo;
}

/// The definition, pixel by pixel: two passes over the region.
RegionStats plain_stats(const Photo& photo, int level, int rx, int ry) {
  const int side = 1 << level;
  const int x0 = rx * side, y0 = ry * side;
  const int x1 = std::min(x0 + side, photo.samples.width()), y1 = std::min(y0 + side, photo.samples.height());
  const auto valid_at = [&](int x, int y) {
    return photo.valid.empty() ? 1.0 : photo.valid.at(x, y) / 255.0;
  };
  const auto object_at = [&](int x, int y) {
    return valid_at(x, y) * (photo.foreground.empty() ? 1.0 : photo.foreground.at(x, y) / 255.0);
  };
  double valid = 0, object = 0;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) valid += valid_at(x, y), object += object_at(x, y);
  RegionStats out{};
  if (valid == 0) return out;
  const double total = object > 0 ? object : valid;
  const auto weight_at = [&](int x, int y) { return object > 0 ? object_at(x, y) : valid_at(x, y); };
  double mean[3] = {}, cov[6] = {};
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x)
      for (int c = 0; c < 3; ++c) mean[c] += weight_at(x, y) / total * photo.samples.pixel(x, y)[c];
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const float* p = photo.samples.pixel(x, y);
      const double d[3] = {p[0] - mean[0], p[1] - mean[1], p[2] - mean[2]};
      const double products[6] = {d[0] * d[0], d[1] * d[1], d[2] * d[2],
                                  d[0] * d[1], d[0] * d[2], d[1] * d[2]};
      for (int i = 0; i < 6; ++i) cov[i] += weight_at(x, y) / total * products[i];
    }
  for (int c = 0; c < 3; ++c) out.mean[c] = float(mean[c]);
  for (int i = 0; i < 6; ++i) out.cov[i] = float(cov[i]);
  out.valid = float(valid / (double(side) * side));
  out.foreground = float(object / valid);
  return out;
}

/// Floats of magnitude 100 (mean) and 1e4 (cov) carry 6e-8 relative; a few roundings are granted.
void expect_equal(const RegionStats& found, const RegionStats& expected) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.mean[c], expected.mean[c], 3e-5);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(found.cov[i], expected.cov[i], 3e-3);
  EXPECT_NEAR(found.valid, expected.valid, 1e-6);
  EXPECT_NEAR(found.foreground, expected.foreground, 1e-6);
}

TEST(SamplePyramid, IsTheBruteForceAtEveryLevelForOddSizesAndMasks) {
  const int sizes[][2] = {{37, 23}, {1, 1}, {64, 32}, {5, 33}};
  unsigned seed = 1;
  for (const auto& size : sizes)
    for (Masks masks : {Masks::kNone, Masks::kValid, Masks::kForeground, Masks::kBoth}) {
      const Photo photo = random_photo(size[0], size[1], masks, seed++);
      const SamplePyramid pyramid(photo.samples, photo.valid, photo.foreground, 0, 7);
      for (int level = 0; level <= 7; ++level) {
        ASSERT_EQ(pyramid.width(level), (size[0] + (1 << level) - 1) >> level);
        ASSERT_EQ(pyramid.height(level), (size[1] + (1 << level) - 1) >> level);
        for (int y = 0; y < pyramid.height(level); ++y)
          for (int x = 0; x < pyramid.width(level); ++x) {
            SCOPED_TRACE(testing::Message()
                         << size[0] << "x" << size[1] << " level " << level << " " << x << "," << y);
            expect_equal(pyramid.at(level, x, y), plain_stats(photo, level, x, y));
          }
      }
    }
}

TEST(SamplePyramid, StoresTheSameLevelsWhateverTheFinest) {
  const Photo photo = random_photo(50, 31, Masks::kBoth, 9);
  const SamplePyramid all(photo.samples, photo.valid, photo.foreground, 0, 5);
  const SamplePyramid some(photo.samples, photo.valid, photo.foreground, 2, 4);
  EXPECT_EQ(some.finest_level(), 2);
  EXPECT_EQ(some.coarsest_level(), 4);
  for (int level = 2; level <= 4; ++level)
    for (int y = 0; y < all.height(level); ++y)
      for (int x = 0; x < all.width(level); ++x) {
        const RegionStats a = all.at(level, x, y), b = some.at(level, x, y);
        EXPECT_EQ(a.mean[0], b.mean[0]);
        EXPECT_EQ(a.cov[5], b.cov[5]);
        EXPECT_EQ(a.valid, b.valid);
      }
}

TEST(SamplePyramid, KeepsSmallVarianceOnALargeOffset) {
  // HDR: 4096 +- 1/8 exactly. Sums of squares in floats would lose the variance; moments about the mean do
  // not.
  Image samples(64, 64, 3);
  for (std::size_t i = 0; i < samples.data().size(); ++i)
    samples.data()[i] = 4096.0f + (i / 3 % 2 ? 0.125f : -0.125f);
  const SamplePyramid pyramid(samples, {}, {}, 6, 6);
  EXPECT_FLOAT_EQ(pyramid.at(6, 0, 0).mean[1], 4096.0f);
  for (float cov : pyramid.at(6, 0, 0).cov) EXPECT_FLOAT_EQ(cov, 1 / 64.0f);
}

TEST(SamplePyramid, TakesTheObjectsColourAtAnOutline) {
  Image samples(2, 2, 3);
  for (int i = 0; i < 12; ++i) samples.data()[i] = i < 3 ? 7.0f : 100.0f;
  Mask foreground(2, 2, 0);
  foreground.at(0, 0) = 255;
  const SamplePyramid pyramid(samples, {}, foreground, 1, 1);
  const RegionStats region = pyramid.at(1, 0, 0);
  EXPECT_FLOAT_EQ(region.mean[0], 7);
  EXPECT_FLOAT_EQ(region.cov[0], 0);
  EXPECT_FLOAT_EQ(region.foreground, 0.25f);
  EXPECT_FLOAT_EQ(region.valid, 1);
}

TEST(SamplePyramid, InvalidRegionsAreAllZero) {
  const Photo photo = random_photo(8, 8, Masks::kNone, 3);
  const SamplePyramid pyramid(photo.samples, Mask(8, 8, 0), {}, 0, 3);
  for (int level = 0; level <= 3; ++level) {
    const RegionStats region = pyramid.at(level, 0, 0);
    EXPECT_EQ(region.valid, 0);
    EXPECT_EQ(region.foreground, 0);
    EXPECT_EQ(region.mean[0], 0);
    EXPECT_EQ(region.cov[0], 0);
  }
}

TEST(SamplePyramid, StaysWithinItsMemoryBound) {
  const int width = 403, height = 305;
  const double pixels = width * height;
  const Photo photo = random_photo(width, height, Masks::kBoth, 4);
  const Mask none;
  const double slack = 1.1;  // borders of odd sizes, headers
  EXPECT_LT(SamplePyramid(photo.samples, none, none, 0, 0).bytes(), slack * 12 * pixels);
  EXPECT_LT(SamplePyramid(photo.samples, photo.valid, photo.foreground, 0, 0).bytes(), slack * 14 * pixels);
  EXPECT_LT(SamplePyramid(photo.samples, photo.valid, photo.foreground, 0, 6).bytes(),
            slack * (14 + 44 / 3.0) * pixels);
  EXPECT_LT(SamplePyramid(photo.samples, photo.valid, photo.foreground, 2, 6).bytes(),
            slack * 44 / 12.0 * pixels);
}

TEST(SamplePyramid, BilinearIsExactForALinearRamp) {
  Image samples(32, 24, 3);
  for (int y = 0; y < 24; ++y)
    for (int x = 0; x < 32; ++x)
      for (int c = 0; c < 3; ++c) samples.pixel(x, y)[c] = float((x + 0.5) * (c + 1) - 2 * (y + 0.5));
  const SamplePyramid pyramid(samples, {}, {}, 0, 3);
  for (int level = 0; level <= 2; ++level)
    for (double u : {5.0, 12.25, 20.5})
      for (double v : {6.0, 9.75, 16.5}) {
        float mean[3];
        ASSERT_TRUE(pyramid.bilinear(level, u, v, mean));
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(mean[c], u * (c + 1) - 2 * v, 1e-4) << level << " " << u << " " << v;
      }
}

TEST(SamplePyramid, BilinearLeavesOutInvalidAndBackgroundNeighbours) {
  Image samples(2, 1, 3);
  samples.pixel(0, 0)[0] = 10;
  samples.pixel(1, 0)[0] = 90;
  Mask right_only(2, 1, 0);
  right_only.at(1, 0) = 255;
  float mean[3];
  const SamplePyramid plain(samples, {}, {}, 0, 0);
  ASSERT_TRUE(plain.bilinear(0, 1.25, 0.5, mean));
  EXPECT_FLOAT_EQ(mean[0], 70);
  ASSERT_TRUE(plain.bilinear(0, -3, 7, mean));
  EXPECT_FLOAT_EQ(mean[0], 10);
  const SamplePyramid masked(samples, right_only, {}, 0, 0);
  ASSERT_TRUE(masked.bilinear(0, 1.25, 0.5, mean));
  EXPECT_FLOAT_EQ(mean[0], 90);
  EXPECT_FALSE(masked.bilinear(0, 0.25, 0.5, mean));
  const SamplePyramid object(samples, {}, right_only, 0, 0);
  ASSERT_TRUE(object.bilinear(0, 1.25, 0.5, mean));
  EXPECT_FLOAT_EQ(mean[0], 90);
  ASSERT_TRUE(object.bilinear(0, 0.75, 0.5, mean));  // on the background's side both count
  EXPECT_FLOAT_EQ(mean[0], 30);
}

TEST(SamplePyramid, RefusesWhatDoesNotFit) {
  const Image samples(4, 4, 3);
  EXPECT_THROW(SamplePyramid(Image(4, 4, 1), {}, {}, 0, 1), std::logic_error);
  EXPECT_THROW(SamplePyramid(samples, Mask(4, 3), {}, 0, 1), std::logic_error);
  EXPECT_THROW(SamplePyramid(samples, {}, Mask(3, 4), 0, 1), std::logic_error);
  EXPECT_THROW(SamplePyramid(samples, {}, {}, 2, 1), std::logic_error);
  EXPECT_THROW(SamplePyramid(samples, {}, {}, -1, 1), std::logic_error);
}

}  // namespace
}  // namespace roxel

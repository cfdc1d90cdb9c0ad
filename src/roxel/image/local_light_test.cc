#include "roxel/image/local_light.h"

#include <gtest/gtest.h>

#include <cmath>

namespace roxel {
namespace {

LocalLightOptions exact(double blur_px = 6, double tint = 0.5) {
  LocalLightOptions options;
  options.blur_px = blur_px;
  options.tint = tint;
  options.darkest = 0;
  return options;
}

/// Patches with some of everything, brightness 0.1 to 1.
Image patches(int width, int height) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c)
        image.pixel(x, y)[c] = 0.1f + 0.9f * static_cast<float>((x / 3 * 7 + y / 4 * 5 + c * 3) % 11) / 10;
  return image;
}

Image scaled(Image image, std::array<float, 3> by) {
  for (std::size_t i = 0; i < image.data().size(); ++i) image.data()[i] *= by[i % 3];
  return image;
}

void expect_near(const Image& a, const Image& b, double relative) {
  ASSERT_EQ(a.data().size(), b.data().size());
  for (std::size_t i = 0; i < a.data().size(); ++i) EXPECT_NEAR(a.data()[i] / b.data()[i], 1, relative);
}

TEST(WithoutLocalLight, ForgetsExposure) {
  const Image image = patches(40, 30);
  expect_near(without_local_light(scaled(image, {5, 5, 5}), {}, {}, exact()),
              without_local_light(image, {}, {}, exact()), 1e-4);
}

// A tint g_c with geometric mean 1 leaves g_c^(1 - tint).
TEST(WithoutLocalLight, KeepsTheShareOfATintThatIsAskedFor) {
  const Image image = patches(40, 30);
  const std::array<float, 3> tint{2, 1, 0.5f};
  for (const double share : {0.0, 0.5, 1.0}) {
    const auto kept = [&](float t) { return std::pow(t, static_cast<float>(1 - share)); };
    expect_near(without_local_light(scaled(image, tint), {}, {}, exact(6, share)),
                scaled(without_local_light(image, {}, {}, exact(6, share)),
                       {kept(tint[0]), kept(tint[1]), kept(tint[2])}),
                1e-4);
  }
}

TEST(WithoutLocalLight, FlatAreasComeToTheMeanLevelAndTextureStays) {
  Image image(60, 60, 3, 0.5f);
  for (int y = 20; y < 60; ++y)
    for (int x = 0; x < 60; ++x)
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = (x + y) % 2 ? 0.4f : 0.2f;
  const Image out = without_local_light(image, {}, {}, exact(3));
  EXPECT_NEAR(out.pixel(30, 3)[1], 0.18, 0.002);
  EXPECT_NEAR(out.pixel(30, 45)[1] / out.pixel(31, 45)[1], image.pixel(30, 45)[1] / image.pixel(31, 45)[1],
              1e-3);
  EXPECT_NEAR(out.pixel(30, 45)[1] * out.pixel(31, 45)[1], 0.18 * 0.18, 0.002);
}

// Far from its edge, a shadow is gone.
TEST(WithoutLocalLight, ShadowsGoBeyondTheBlur) {
  const Image image = patches(120, 24);
  Image shaded = image;
  for (int y = 0; y < 24; ++y)
    for (int x = 0; x < 60; ++x)
      for (int c = 0; c < 3; ++c) shaded.pixel(x, y)[c] *= 0.2f;
  const Image lit = without_local_light(image, {}, {}, exact(5)),
              out = without_local_light(shaded, {}, {}, exact(5));
  for (const int x : {10, 30, 90, 110}) EXPECT_NEAR(out.pixel(x, 12)[0] / lit.pixel(x, 12)[0], 1, 0.01) << x;
  EXPECT_LT(out.pixel(58, 12)[0] / lit.pixel(58, 12)[0], 0.7);
}

TEST(WithoutLocalLight, PixelsOutsideTheMasksDoNotCount) {
  const Image image = patches(40, 30);
  Image spoilt = image;
  Mask mask(40, 30);
  for (int y = 0; y < 30; ++y)
    for (int x = 20; x < 40; ++x) {
      mask.at(x, y) = 0;
      for (int c = 0; c < 3; ++c) spoilt.pixel(x, y)[c] = 1000;
    }
  const Image by_valid = without_local_light(spoilt, mask, {}, exact());
  const Image by_foreground = without_local_light(spoilt, {}, mask, exact());
  const Image unspoilt = without_local_light(image, mask, {}, exact());
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 20; ++x) {
      EXPECT_FLOAT_EQ(by_valid.pixel(x, y)[0], unspoilt.pixel(x, y)[0]);
      EXPECT_FLOAT_EQ(by_foreground.pixel(x, y)[0], unspoilt.pixel(x, y)[0]);
    }
}

TEST(WithoutLocalLight, StaysFiniteInTheDarkAndWithoutAnyPixel) {
  LocalLightOptions options;
  options.blur_px = 4;
  const Image black = without_local_light(Image(8, 8, 3, 0.0f), {}, {}, options);
  for (const float value : black.data()) EXPECT_NEAR(value, options.mean_level, 1e-3);
  const Image unseen = without_local_light(patches(8, 8), {}, Mask(8, 8, 0), options);
  for (const float value : unseen.data()) EXPECT_TRUE(std::isfinite(value));
}

}  // namespace
}  // namespace roxel

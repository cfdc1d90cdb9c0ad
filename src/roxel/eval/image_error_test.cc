#include "roxel/eval/image_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "roxel/color/color_space.h"

namespace roxel {
namespace {

TEST(ImageError, IsTheRmsOfEncodedValuesInPercent) {
  Image photo(2, 1, 3), render(2, 1, 3);
  // Encoded differences: pixel 0: 0.2 in one channel; pixel 1: 0.1 in all.
  for (int c = 0; c < 3; ++c) {
    photo.pixel(0, 0)[c] = render.pixel(0, 0)[c] = srgb_decode(0.5f);
    photo.pixel(1, 0)[c] = srgb_decode(0.3f);
    render.pixel(1, 0)[c] = srgb_decode(0.4f);
  }
  render.pixel(0, 0)[1] = srgb_decode(0.7f);
  EXPECT_NEAR(reprojection_rms(render, photo, {}), 100 * std::sqrt((0.04 + 3 * 0.01) / 6), 1e-4);
}

TEST(ImageError, CountsOnlyTheObject) {
  Image photo(3, 1, 3, 0.0f), render(3, 1, 3, 1.0f);
  for (int c = 0; c < 3; ++c) render.pixel(0, 0)[c] = 0;
  Mask mask(3, 1, 127);
  mask.at(0, 0) = 255;
  EXPECT_EQ(reprojection_rms(render, photo, mask), 0);
  mask.at(1, 0) = 128;
  EXPECT_NEAR(reprojection_rms(render, photo, mask), 100 * std::sqrt(0.5), 1e-4);
  EXPECT_EQ(reprojection_rms(render, photo, Mask(3, 1, 0)), 0);
}

TEST(ImageError, ClampsBothToTheDisplay) {
  EXPECT_NEAR(reprojection_rms(Image(1, 1, 3, 40.0f), Image(1, 1, 3, 1.0f), {}), 0, 1e-9);
  EXPECT_NEAR(reprojection_rms(Image(1, 1, 3, -2.0f), Image(1, 1, 3, 0.0f), {}), 0, 1e-9);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NEAR(reprojection_rms(Image(1, 1, 3, nan), Image(1, 1, 3, 1.0f), {}), 100, 1e-4);
}

TEST(ImageError, ViewsAddUpByPixels) {
  ImageError sum = image_error(Image(1, 1, 3, 1.0f), Image(1, 1, 3, 0.0f), {});
  sum.add(image_error(Image(3, 1, 3, 0.0f), Image(3, 1, 3, 0.0f), {}));
  EXPECT_EQ(sum.pixel_count, 4);
  EXPECT_NEAR(sum.rms_percent(), 50, 1e-4);
}

TEST(ImageError, RefusesOtherSizes) {
  EXPECT_THROW(image_error(Image(2, 1, 3), Image(1, 2, 3), {}), std::logic_error);
  EXPECT_THROW(image_error(Image(2, 1, 3), Image(2, 1, 3), Mask(1, 1)), std::logic_error);
}

}  // namespace
}  // namespace roxel

#include "roxel/report/pictures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace roxel {
namespace {

constexpr float kCode = 1.0f / 255;

Image plane(int width, int height, float value) { return Image(width, height, 1, value); }

float warmth(const float* rgb) { return rgb[0] - rgb[2]; }
float brightness(const float* rgb) { return rgb[0] + rgb[1] + rgb[2]; }

TEST(EncodedPicture, DividesByWhiteEncodesAndClamps) {
  Image light(4, 1, 3);
  const float values[4] = {0.0f, 1.0f, 2.0f, 8.0f};
  for (int x = 0; x < 4; ++x)
    for (int c = 0; c < 3; ++c) light.pixel(x, 0)[c] = values[x];
  light.pixel(0, 0)[1] = std::numeric_limits<float>::quiet_NaN();
  const Image linear = encoded_picture(light, 4, {ResponseCurve::kLinear});
  const float expected[4] = {0, 0.25f, 0.5f, 1};
  for (int x = 0; x < 4; ++x) EXPECT_NEAR(linear.pixel(x, 0)[0], expected[x], 1e-6);
  EXPECT_EQ(linear.pixel(0, 0)[1], 0);
  EXPECT_NEAR(encoded_picture(light, 4, {}).pixel(2, 0)[0], 0.7354, 1e-4);  // sRGB of one half
}

TEST(ShownDepths, LeavesOutlyingAndTransparentPixelsOut) {
  Image depth = plane(100, 10, 5), opacity = plane(100, 10, 1);
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 100; ++x) *depth.pixel(x, y) = 1 + 0.01f * static_cast<float>(x);
  *depth.pixel(0, 0) = 0.001f;
  *depth.pixel(1, 0) = 1000;
  for (int x = 0; x < 100; ++x) *depth.pixel(x, 5) = 500, *opacity.pixel(x, 5) = 0.4f;
  const ShownDepths shown = shown_depths(depth, opacity);
  EXPECT_NEAR(shown.near, 1.02, 0.011);
  EXPECT_NEAR(shown.far, 1.98, 0.011);
  EXPECT_EQ(shown_depths(depth, plane(100, 10, 0)).far, 0);
}

TEST(DepthPicture, NearIsWarmFarIsColdAndNothingIsBlack) {
  Image depth = plane(3, 1, 0), opacity = plane(3, 1, 1);
  *depth.pixel(0, 0) = 2;
  *depth.pixel(1, 0) = 4;
  *opacity.pixel(2, 0) = 0;
  const Image picture = depth_picture(depth, opacity, {2, 4});
  EXPECT_GT(warmth(picture.pixel(0, 0)), 0.1f);
  EXPECT_LT(warmth(picture.pixel(1, 0)), -0.1f);
  EXPECT_EQ(brightness(picture.pixel(2, 0)), 0);
}

TEST(DepthPicture, FadesWithOpacity) {
  Image depth = plane(2, 1, 3), opacity = plane(2, 1, 1);
  *opacity.pixel(1, 0) = 0.25f;
  const Image picture = depth_picture(depth, opacity, {2, 4});
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(picture.pixel(1, 0)[c], 0.25f * picture.pixel(0, 0)[c], kCode);
}

TEST(DepthPicture, ShadesSlopesThatTurnAway) {
  Image flat = plane(40, 40, 3), slope = plane(40, 40, 3);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x) *slope.pixel(x, y) = 3 - 0.2f * static_cast<float>(x - 20);
  const Image opacity = plane(40, 40, 1);
  const Image lit = depth_picture(flat, opacity, {2, 4}), turned = depth_picture(slope, opacity, {2, 4});
  EXPECT_LT(brightness(turned.pixel(20, 20)), 0.9f * brightness(lit.pixel(20, 20)));
}

TEST(ErrorPicture, IsBlackWithoutErrorAndWhiteAtTheHottest) {
  Image photo(3, 1, 3, 0.5f), render = photo;
  for (int c = 0; c < 3; ++c) render.pixel(1, 0)[c] = 0.5f + kHottestError / 2;
  for (int c = 0; c < 3; ++c) render.pixel(2, 0)[c] = 0.5f - kHottestError;
  const Image heat = error_picture(render, photo, {}, {});
  EXPECT_EQ(brightness(heat.pixel(0, 0)), 0);
  EXPECT_GT(brightness(heat.pixel(1, 0)), 0.5f);
  EXPECT_LT(brightness(heat.pixel(1, 0)), 2);
  EXPECT_NEAR(brightness(heat.pixel(2, 0)), 3, 1e-4);
  Mask valid(3, 1);
  valid.at(2, 0) = 0;
  EXPECT_EQ(brightness(error_picture(render, photo, valid, {}).pixel(2, 0)), 0);
}

TEST(ErrorPicture, OutsideTheObjectNothingShouldBeSeen) {
  const Image photo(2, 1, 3, 0.8f);
  Image render = photo;
  for (int c = 0; c < 3; ++c) render.pixel(1, 0)[c] = 0;
  Mask foreground(2, 1);
  foreground.at(0, 0) = 0, foreground.at(1, 0) = 0;
  const Image heat = error_picture(render, photo, {}, foreground);
  EXPECT_NEAR(brightness(heat.pixel(0, 0)), 3, 1e-4);  // debris
  EXPECT_EQ(brightness(heat.pixel(1, 0)), 0);
}

TEST(ErrorPicture, IsTheRootMeanSquareOverTheChannels) {
  const Image photo(1, 1, 3, 0.2f);
  Image one_channel = photo, all_channels = photo;
  one_channel.pixel(0, 0)[1] += 0.1f * std::sqrt(3.0f);
  for (int c = 0; c < 3; ++c) all_channels.pixel(0, 0)[c] += 0.1f;
  const Image a = error_picture(one_channel, photo, {}, {}), b = error_picture(all_channels, photo, {}, {});
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a.pixel(0, 0)[c], b.pixel(0, 0)[c], 1e-4);
}

TEST(SigmaPicture, IsBlackWhereDepthIsSureAndGreyWhereThereIsNone) {
  Image depth(4, 1, 1, 2.0f), opacity(4, 1, 1, 1.0f), variance(4, 1, 1);
  const float voxel = 0.5f;
  *variance.pixel(1, 0) = std::pow(kHottestSigma / 2 * voxel, 2.0f);
  *variance.pixel(2, 0) = std::pow(kHottestSigma * voxel, 2.0f);
  *depth.pixel(3, 0) = 0;
  const Image heat = sigma_picture(variance, depth, opacity, voxel);
  EXPECT_EQ(brightness(heat.pixel(0, 0)), 0);
  EXPECT_GT(brightness(heat.pixel(1, 0)), 0.5f);
  EXPECT_LT(brightness(heat.pixel(1, 0)), 2);
  EXPECT_NEAR(brightness(heat.pixel(2, 0)), 3, 1e-4);
  EXPECT_NEAR(brightness(heat.pixel(3, 0)), 3 * 0.75f, 1e-4);
}

TEST(DepthErrorPicture, TellsNearFromFarAndMissingFromRight) {
  const float voxel = 0.5f;
  Image truth(6, 1, 1, 10.0f), depth = truth, opacity(6, 1, 1, 1.0f);
  *depth.pixel(1, 0) = 10 - kFullestDepthError * voxel;
  *depth.pixel(2, 0) = 10 + kFullestDepthError * voxel;
  *depth.pixel(3, 0) = 10 + kFullestDepthError * voxel / 2;
  *opacity.pixel(4, 0) = 0.4f;
  *opacity.pixel(5, 0) = 0.4f;
  *truth.pixel(5, 0) = 0;
  const Image picture = depth_error_picture(depth, opacity, truth, voxel);
  EXPECT_EQ(brightness(picture.pixel(0, 0)), 3);
  EXPECT_GT(picture.pixel(1, 0)[2], picture.pixel(1, 0)[0] + 0.3f);  // too near: blue
  EXPECT_GT(picture.pixel(2, 0)[0], picture.pixel(2, 0)[2] + 0.3f);  // too far: red
  EXPECT_GT(brightness(picture.pixel(3, 0)), brightness(picture.pixel(2, 0)));
  EXPECT_EQ(brightness(picture.pixel(4, 0)), 0);  // missed
  EXPECT_NEAR(brightness(picture.pixel(5, 0)), 3 * 0.75f, 1e-6);
}

TEST(Thumbnail, AveragesAreasAndNeverEnlarges) {
  Image picture(6, 4, 3);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 6; ++x) picture.pixel(x, y)[0] = static_cast<float>(x);
  const Image small = thumbnail(picture, 3);
  ASSERT_EQ(small.width(), 3);
  ASSERT_EQ(small.height(), 2);
  for (int x = 0; x < 3; ++x) EXPECT_FLOAT_EQ(small.pixel(x, 1)[0], 2 * static_cast<float>(x) + 0.5f);
  EXPECT_EQ(thumbnail(picture, 6).width(), 6);
  EXPECT_EQ(thumbnail(picture, 100).width(), 6);
  EXPECT_EQ(thumbnail(Image(1000, 2, 3), 10).height(), 1);
}

TEST(ContactSheet, HoldsEveryPictureWhereItsColumnIs) {
  const Image red = [] {
    Image image(4, 3, 3);
    for (int i = 0; i < 12; ++i) image.data()[3 * i] = 1;
    return image;
  }();
  const Image grey(2, 5, 3, 0.5f);
  const Image sheet = contact_sheet({{red, grey}, {grey, red}});
  EXPECT_EQ(sheet.width(), 6 + 4 + 6 + 4 + 6);
  EXPECT_EQ(sheet.height(), 6 + 5 + 6 + 5 + 6);
  EXPECT_EQ(sheet.pixel(6, 6)[0], 1);
  EXPECT_EQ(sheet.pixel(16, 6)[2], 0.5f);
  EXPECT_EQ(sheet.pixel(6, 17)[2], 0.5f);
  EXPECT_EQ(sheet.pixel(16, 17)[0], 1);
  EXPECT_LT(sheet.pixel(0, 0)[0], 0.2f);
}

}  // namespace
}  // namespace roxel

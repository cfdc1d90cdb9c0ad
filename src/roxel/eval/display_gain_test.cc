#include "roxel/eval/display_gain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace roxel {
namespace {

/// Colours from dark to light, another order in each channel.
Image ramp(int side) {
  Image image(side, side, 3);
  for (int i = 0; i < side * side; ++i)
    for (int c = 0; c < 3; ++c)
      image.data()[3 * i + c] =
          0.02f + 0.4f * static_cast<float>((i * (7 + c)) % (side * side)) / (side * side);
  return image;
}

TEST(DisplayGain, FindsTheLightAPhotographWasTakenIn) {
  const Image rendered = ramp(40);
  const std::array<double, 3> light = {0.31, 1.7, 2.2};
  Image photo = rendered;
  for (std::size_t i = 0; i < photo.data().size(); ++i) photo.data()[i] *= static_cast<float>(light[i % 3]);
  const auto gain = display_gain(rendered, photo, 1, {}, {});
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(gain[c] / light[c], 1, 2e-4) << c;
  Image bright = photo;  // the same on a display whose white is 50
  for (float& value : bright.data()) value *= 50;
  const auto again = display_gain(rendered, bright, 50, {}, {});
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(again[c] / light[c], 1, 2e-4) << c;
}

TEST(DisplayGain, MakesTheErrorLeastThatADisplayShows) {
  const Image rendered = ramp(30);
  Image photo = rendered;  // two lights: no one gain is right
  for (std::size_t i = 0; i < photo.data().size(); ++i) photo.data()[i] *= i % 2 ? 0.4f : 1.5f;
  const Response response;
  const auto gain = display_gain(rendered, photo, 1, {}, response);
  const auto squares = [&](int c, double by) {
    double sum = 0;
    for (std::size_t i = c; i < photo.data().size(); i += 3)
      sum += std::pow(
          encode(response, static_cast<float>(by) * rendered.data()[i]) - encode(response, photo.data()[i]),
          2);
    return sum;
  };
  for (int c = 0; c < 3; ++c)
    for (const double by : {0.7, 0.98, 1.02, 1.4})
      EXPECT_LT(squares(c, gain[c]), squares(c, by * gain[c])) << c << " " << by;
}

TEST(DisplayGain, LeavesOutWhatDoesNotCountAndWhatClips) {
  const Image rendered = ramp(40);
  Image photo = rendered;
  Mask counted(40, 40);
  for (int i = 0; i < 1600; ++i) {
    counted.data()[i] = i < 800 ? 255 : 0;
    for (int c = 0; c < 3; ++c) {
      // A light of three: the brighter third is above white on any display. The other half is of another
      // light.
      float& value = photo.data()[3 * i + c];
      value = i < 800 ? std::min(1.0f, 3 * value) : 0.1f * value;
    }
  }
  for (const double gain : display_gain(rendered, photo, 1, counted, {})) EXPECT_NEAR(gain, 3, 0.001);
  EXPECT_LT(display_gain(rendered, photo, 1, {}, {})[0], 2.5);
}

TEST(DisplayGain, IsOneWhereNothingIsSeen) {
  const Image black(8, 8, 3);
  for (const double gain : display_gain(black, ramp(8), 1, {}, {})) EXPECT_EQ(gain, 1);
  Mask none(8, 8);
  std::fill(none.data().begin(), none.data().end(), std::uint8_t{0});
  Image other = ramp(8);
  for (float& value : other.data()) value *= 2;
  for (const double gain : display_gain(ramp(8), other, 1, none, {})) EXPECT_EQ(gain, 1);
}

}  // namespace
}  // namespace roxel

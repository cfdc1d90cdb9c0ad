#include "roxel/image/outline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace roxel {
namespace {

constexpr int kWidth = 32, kHeight = 24;

/// A disc of radius 6 around (9.3, 12.1): each pixel's share of 16 x 16 points.
Mask disc() {
  Mask mask(kWidth, kHeight, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      int inside = 0;
      for (int j = 0; j < 16; ++j)
        for (int i = 0; i < 16; ++i)
          inside += std::hypot(x + (i + 0.5) / 16 - 9.3, y + (j + 0.5) / 16 - 12.1) < 6;
      mask.at(x, y) = static_cast<std::uint8_t>(inside * 255 / 256);
    }
  return mask;
}

/// Whether the circle passes through the pixel, and not just its corner.
bool circle_cuts(int x, int y) {
  int inside = 0;
  for (int corner = 0; corner < 4; ++corner)
    inside += std::hypot(x + (corner & 1) - 9.3, y + (corner >> 1) - 12.1) < 6;
  return inside > 0 && inside < 4;
}

TEST(LighterOnOutline, ThePixelsThatTheOutlineCutsAndNoOther) {
  const Mask object = disc(), made = lighter_on_outline({}, object, 0.25);
  int cut = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      SCOPED_TRACE(std::to_string(x) + " " + std::to_string(y));
      if (!circle_cuts(x, y)) {
        EXPECT_EQ(made.at(x, y), 255);
        continue;
      }
      const bool hardly = object.at(x, y) <= 5 || object.at(x, y) >= 250;
      const double share = object.at(x, y) / 255.0;
      const double expected = 255 * (1 - 0.75 * 4 * share * (1 - share));
      EXPECT_NEAR(made.at(x, y), hardly ? 255 : expected, 0.5);
      cut += !hardly;
    }
  EXPECT_GT(cut, 30);
}

TEST(LighterOnOutline, ThePixelThatIsHalfObjectHasTheLeastWeight) {
  Mask object(5, 1, 255);
  object.at(0, 0) = 64, object.at(2, 0) = 128, object.at(4, 0) = 191;
  const Mask made = lighter_on_outline({}, object, 0);
  EXPECT_EQ(made.data(), (std::vector<std::uint8_t>{63, 255, 0, 255, 63}));  // a quarter of the weight, none
}

TEST(LighterOnOutline, NoiseOfAFileIsNoOutline) {
  Mask object(kWidth, kHeight, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) object.at(x, y) = x < 10 ? 250 + (x + y) % 6 : (x + y) % 6;
  const Mask made = lighter_on_outline({}, object, 0);
  EXPECT_EQ(made.data(), Mask(kWidth, kHeight, 255).data());
}

TEST(LighterOnOutline, WhatIsThinnerThanAPixelKeepsItsPixels) {
  Mask wire(kWidth, kHeight, 0);
  for (int y = 0; y < kHeight; ++y) wire.at(7, y) = wire.at(8, y) = 120;
  EXPECT_EQ(lighter_on_outline({}, wire, 0).data(), Mask(kWidth, kHeight, 255).data());
}

TEST(LighterOnOutline, ScalesWhatIsValid) {
  Mask object(4, 2, 128), valid(4, 2, 100);
  object.at(1, 0) = 255;
  valid.at(2, 0) = 0;
  const std::vector<std::uint8_t> made{30, 100, 0,  100,  //
                                       30, 30,  30, 100};
  EXPECT_EQ(lighter_on_outline(valid, object, 0.3).data(), made);
}

TEST(LighterOnOutline, ChangesNothingWithoutMaskOrLessWeight) {
  EXPECT_TRUE(lighter_on_outline({}, {}, 0.5).empty());
  EXPECT_TRUE(lighter_on_outline({}, disc(), 1).empty());
  const Mask valid(kWidth, kHeight, 77);
  EXPECT_EQ(lighter_on_outline(valid, Mask(kWidth, kHeight, 0), 0).data(), valid.data());
  EXPECT_EQ(lighter_on_outline(valid, Mask(kWidth, kHeight, 255), 0).data(), valid.data());
}

}  // namespace
}  // namespace roxel

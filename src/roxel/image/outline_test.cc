#include "roxel/image/outline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace roxel {
namespace {

/// A disc and a single pixel apart from it.
Mask some_object(int width, int height) {
  Mask mask(width, height, 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (std::hypot(x - 9.0, y - 12.0) < 6 || (x == 25 && y == 3)) mask.at(x, y) = 200;
  return mask;
}

TEST(LighterBesideOutline, ReachesAllBackgroundWithinTheRadiusAndNothingElse) {
  const Mask object = some_object(32, 24);
  for (const double radius : {1.0, 1.5, 3.2, 7.0}) {
    SCOPED_TRACE(radius);
    const Mask made = lighter_beside_outline({}, object, radius, 0.25);
    for (int y = 0; y < 24; ++y)
      for (int x = 0; x < 32; ++x) {
        double nearest = 1e9;
        for (int v = 0; v < 24; ++v)
          for (int u = 0; u < 32; ++u)
            if (object.at(u, v) >= 128) nearest = std::min(nearest, std::hypot(u - x, v - y));
        EXPECT_EQ(made.at(x, y), nearest > 0 && nearest <= radius ? 64 : 255) << x << " " << y;
      }
  }
}

TEST(LighterBesideOutline, ScalesWhatIsValid) {
  Mask valid(32, 24, 255);
  valid.at(25, 4) = 100;
  valid.at(24, 3) = 0;
  valid.at(25, 3) = 30;  // the object itself
  const Mask made = lighter_beside_outline(valid, some_object(32, 24), 1, 0.5);
  EXPECT_EQ(made.at(25, 4), 50);
  EXPECT_EQ(made.at(24, 3), 0);
  EXPECT_EQ(made.at(25, 3), 30);
  EXPECT_EQ(made.at(26, 3), 128);
}

TEST(LighterBesideOutline, ChangesNothingWithoutMaskRadiusOrLessWeight) {
  const Mask object = some_object(32, 24);
  EXPECT_TRUE(lighter_beside_outline({}, {}, 3, 0.5).empty());
  EXPECT_TRUE(lighter_beside_outline({}, object, 0.9, 0.5).empty());
  EXPECT_TRUE(lighter_beside_outline({}, object, 3, 1).empty());
  const Mask valid(32, 24, 77);
  EXPECT_EQ(lighter_beside_outline(valid, Mask(32, 24, 0), 3, 0).data(), valid.data());
  EXPECT_EQ(lighter_beside_outline(valid, Mask(32, 24, 255), 3, 0).data(), valid.data());
}

}  // namespace
}  // namespace roxel

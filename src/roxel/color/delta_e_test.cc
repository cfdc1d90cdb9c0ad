#include "roxel/color/delta_e.h"

#include <gtest/gtest.h>

namespace roxel {
namespace {

TEST(DeltaE, AgreesWithPublishedPairs) {
  // [Sharma05] table 1: the pairs that tell implementations apart, to its four places.
  struct Pair {
    Lab a, b;
    double difference;
  };
  const Pair pairs[] = {{{50, 2.6772, -79.7751}, {50, 0, -82.7485}, 2.0425},
                        {{50, 3.1571, -77.2803}, {50, 0, -82.7485}, 2.8615},
                        {{50, 2.8361, -74.0200}, {50, 0, -82.7485}, 3.4412},
                        {{50, -1.3802, -84.2814}, {50, 0, -82.7485}, 1.0000},
                        {{50, 0, 0}, {50, -1, 2}, 2.3669},
                        {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0009}, 7.1792},
                        {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0011}, 7.2195},
                        {{50, 2.5, 0}, {50, 0, -2.5}, 4.3065},
                        {{50, 2.5, 0}, {73, 25, -18}, 27.1492},
                        {{50, 2.5, 0}, {61, -5, 29}, 22.8977},
                        {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
                        {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082}};
  for (const Pair& pair : pairs) {
    EXPECT_NEAR(delta_e_2000(pair.a, pair.b), pair.difference, 5e-5);
    EXPECT_NEAR(delta_e_2000(pair.b, pair.a), pair.difference, 5e-5);
  }
}

TEST(DeltaE, OfEqualColoursIsZeroAndOfBlackAndWhiteAHundred) {
  const Lab white = lab_from_xyz(xyz_from_rgb({1, 1, 1})), black = lab_from_xyz(xyz_from_rgb({0, 0, 0}));
  EXPECT_EQ(delta_e_2000(white, white), 0);
  EXPECT_NEAR(delta_e_2000(white, black), 100, 0.01);
}

TEST(Lab, OfSrgbRed) {
  const Lab red = lab_from_xyz(xyz_from_rgb({1, 0, 0}));
  EXPECT_NEAR(red.l, 53.24, 0.02);
  EXPECT_NEAR(red.a, 80.09, 0.1);
  EXPECT_NEAR(red.b, 67.20, 0.1);
}

}  // namespace
}  // namespace roxel

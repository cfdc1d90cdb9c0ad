#include "roxel/eval/color_accuracy.h"

#include <gtest/gtest.h>

#include <cmath>

#include "roxel/color/delta_e.h"

namespace roxel {
namespace {

TEST(ColorAccuracy, ABrighterLightIsNoError) {
  const std::vector<ColorPair> pairs{{{0.2f, 0.4f, 0.6f}, {0.1f, 0.2f, 0.3f}},
                                     {{0.8f, 0.1f, 0.2f}, {0.4f, 0.05f, 0.1f}}};
  const ColorAccuracy found = color_accuracy(pairs);
  EXPECT_EQ(found.pixels, 2);
  EXPECT_NEAR(found.scale, 0.5, 1e-7);
  EXPECT_NEAR(found.mean_delta_e, 0, 1e-4);
  EXPECT_NEAR(found.mean_relative, 0, 1e-6);
}

TEST(ColorAccuracy, ByHand) {
  // Both estimates are (1, 1, 1): the best factor is the mean of the truths, 0.5.
  const std::vector<ColorPair> pairs{{{1, 1, 1}, {0.4f, 0.4f, 0.4f}}, {{1, 1, 1}, {0.6f, 0.6f, 0.6f}}};
  const ColorAccuracy found = color_accuracy(pairs);
  EXPECT_NEAR(found.scale, 0.5, 1e-7);
  EXPECT_NEAR(found.mean_relative, (0.1 / 0.4 + 0.1 / 0.6) / 2, 1e-6);
  EXPECT_NEAR(found.median_relative, 0.1 / 0.6, 1e-6);
  const auto grey = [](double light) { return lab_from_xyz(xyz_from_rgb({light, light, light})); };
  EXPECT_NEAR(found.delta_e_90,
              std::max(delta_e_2000(grey(0.5), grey(0.4)), delta_e_2000(grey(0.5), grey(0.6))), 1e-4);
}

TEST(ColorAccuracy, ATintIsAnError) {
  const ColorAccuracy tinted = color_accuracy({{{0.5f, 0.4f, 0.3f}, {0.4f, 0.4f, 0.4f}}});
  EXPECT_GT(tinted.mean_delta_e, 5);
}

TEST(ColorAccuracy, BlackTruthIsLeftOut) {
  EXPECT_EQ(color_accuracy({{{0.5f, 0.4f, 0.3f}, {0, 0, 0}}}).pixels, 0);
  EXPECT_EQ(color_accuracy({}).mean_delta_e, 0);
}

TEST(ColorAccuracy, BlackTruthDoesNotMoveTheScale) {
  const std::vector<ColorPair> good{{{0.2f, 0.4f, 0.6f}, {0.1f, 0.2f, 0.3f}},
                                    {{0.8f, 0.1f, 0.2f}, {0.4f, 0.05f, 0.1f}}};
  std::vector<ColorPair> with_black = good;
  with_black.push_back({{0.9f, 0.9f, 0.9f}, {0, 0, 0}});
  const ColorAccuracy found = color_accuracy(with_black);
  EXPECT_EQ(found.pixels, 2);
  EXPECT_NEAR(found.scale, 0.5, 1e-7);
  EXPECT_NEAR(found.mean_relative, 0, 1e-6);
}

TEST(ColorPair, HalfFilledPixelsAreNotDarker) {
  const float over_black[3] = {0.3f, 0.15f, 0}, truth[3] = {0.5f, 0.25f, 0.1f};
  const auto pair = color_pair(over_black, 0.6f, truth);
  ASSERT_TRUE(pair);
  EXPECT_NEAR(pair->estimate[0], 0.5, 1e-6);
  EXPECT_NEAR(pair->estimate[1], 0.25, 1e-6);
  EXPECT_EQ(pair->estimate[2], 0);
  EXPECT_EQ(pair->truth[1], 0.25f);
}

TEST(ColorPair, NoneWhereAColourIsUnknown) {
  const float grey[3] = {0.5f, 0.5f, 0.5f}, unknown[3] = {0.5f, NAN, 0.5f};
  EXPECT_TRUE(color_pair(grey, 1, grey));
  EXPECT_FALSE(color_pair(grey, 1, unknown));
  EXPECT_FALSE(color_pair(unknown, 1, grey));
  EXPECT_FALSE(color_pair(grey, 0, grey));
}

}  // namespace
}  // namespace roxel

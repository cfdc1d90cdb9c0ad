#include "roxel/solve/surface_color.h"

#include <gtest/gtest.h>

#include <cmath>

namespace roxel {
namespace {

const std::array<float, 3> kAlbedo{0.5f, 0.3f, 0.1f};

/// What a node shows of it where the share `truth` of the sun's light arrives and `expected` was marched.
LitColor shown(float diffuse, float sun, float truth, float expected) {
  LitColor color;
  for (int c = 0; c < 3; ++c) {
    color.diffuse[c] = diffuse * (1 + 0.2f * static_cast<float>(c));
    color.sun[c] = sun * (1 - 0.2f * static_cast<float>(c));
    color.seen[c] = kAlbedo[c] * (color.diffuse[c] + truth * color.sun[c]);
  }
  color.sunlit = expected;
  return color;
}

TEST(SurfaceColor, IsExactWhereTheLightIsKnown) {
  const SurfaceColor found = surface_color({shown(0.3f, 0, 0, 1), shown(1, 0, 0, 0)});
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.albedo[c], kAlbedo[c], 1e-4 * kAlbedo[c]);
}

TEST(SurfaceColor, AWrongShadowIsSeenThroughWhereOthersAgree) {
  // Two overcast nodes and a sunny one: marched as sunlit, it lies in the shade.
  const SurfaceColor found =
      surface_color({shown(0.8f, 0, 0, 0), shown(0.4f, 0, 0, 0), shown(0.2f, 2, 0, 1)});
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.albedo[c], kAlbedo[c], 0.03 * kAlbedo[c]);
  EXPECT_LT(found.sunlit[2], 0.1);
}

TEST(SurfaceColor, OneSightingIsTakenAtItsWord) {
  const SurfaceColor sunny = surface_color({shown(0.2f, 2, 1, 1)});
  EXPECT_GT(sunny.sunlit[0], 0.8);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(sunny.albedo[c], kAlbedo[c], 0.15 * kAlbedo[c]);
  const SurfaceColor shaded = surface_color({shown(0.2f, 2, 0, 0)});
  EXPECT_LT(shaded.sunlit[0], 0.2);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(shaded.albedo[c], kAlbedo[c], 0.15 * kAlbedo[c]);
}

TEST(SurfaceColor, SomethingElseInOnePhotographDoesNotCount) {
  LitColor other = shown(1, 0, 0, 0);
  other.seen = {0.02f, 0.02f, 0.9f};
  const SurfaceColor found = surface_color({shown(0.5f, 0, 0, 0), shown(1, 0, 0, 0), other});
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.albedo[c], kAlbedo[c], 0.03 * kAlbedo[c]);
}

TEST(SurfaceColor, ScalesWithLightAndColour) {
  std::vector<LitColor> seen{shown(0.3f, 1, 1, 0.8f), shown(0.5f, 0.5f, 0, 0.3f)};
  const SurfaceColor before = surface_color(seen);
  for (LitColor& color : seen)
    for (int c = 0; c < 3; ++c) color.diffuse[c] *= 3, color.sun[c] *= 3, color.seen[c] *= 3;
  const SurfaceColor after = surface_color(seen);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(after.albedo[c], before.albedo[c], 1e-4 * before.albedo[c]);
}

// More photographs than are tried as the truth: those that weigh most are.
TEST(SurfaceColor, ManySightingsAreSeenThroughByTheirHeaviest) {
  std::vector<LitColor> seen;
  for (int i = 0; i < 200; ++i) {
    LitColor other = shown(1, 0, 0, 0);
    other.seen = {0.02f + 0.004f * static_cast<float>(i), 0.02f, 0.9f};
    other.weight = 0.05f;
    seen.push_back(other);
  }
  for (int i = 0; i < 40; ++i) seen.push_back(shown(0.3f + 0.01f * static_cast<float>(i), 0, 0, 0));
  const SurfaceColor found = surface_color(seen);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.albedo[c], kAlbedo[c], 0.03 * kAlbedo[c]);
}

TEST(SurfaceColor, OfNothingIsNothing) { EXPECT_TRUE(surface_color({}).sunlit.empty()); }

}  // namespace
}  // namespace roxel

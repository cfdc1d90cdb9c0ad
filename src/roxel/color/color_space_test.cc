#include "roxel/color/color_space.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "roxel/base/error.h"

namespace roxel {
namespace {

const std::vector<ColorSpace> kSpaces = {ColorSpace::kRgb, ColorSpace::kSrgb, ColorSpace::kHsv,
                                         ColorSpace::kLuv};

using Rgb = std::array<float, 3>;

Rgb in_space(ColorSpace space, const Rgb& rgb) {
  Rgb out;
  ColorTransform(space).from_rgb(rgb.data(), out.data());
  return out;
}

double draw(int limit, double scale) { return *rc::gen::inRange(0, limit + 1) * scale / limit; }
Rgb draw_rgb(double scale) {
  return {float(draw(1 << 20, scale)), float(draw(1 << 20, scale)), float(draw(1 << 20, scale))};
}

TEST(ColorSpace, NamesRoundTrip) {
  for (ColorSpace space : kSpaces) EXPECT_EQ(parse_color_space(to_string(space)), space);
  EXPECT_THROW(parse_color_space("lab"), InvalidInput);
  EXPECT_THROW(parse_color_space(""), InvalidInput);
}

TEST(Srgb, HasThePublishedCodes) {
  // IEC 61966-2-1: code 188 of 255 is half light, code 119 is 18.4 %; the ends are fixed.
  EXPECT_FLOAT_EQ(srgb_encode(0), 0);
  EXPECT_NEAR(srgb_encode(1), 1, 1e-6);
  EXPECT_NEAR(srgb_encode(0.5f) * 255, 187.5, 0.1);
  EXPECT_NEAR(srgb_decode(119 / 255.0f), 0.1845, 1e-4);
  EXPECT_NEAR(srgb_decode(10 / 255.0f), 10 / 255.0 / 12.92, 1e-7);
}

RC_GTEST_PROP(Srgb, DecodeInvertsEncode, ()) {
  const float light = float(draw(1 << 20, 1.0) * *rc::gen::element(1.0, 1e-3, 1e4, -1.0));
  RC_ASSERT(std::abs(srgb_decode(srgb_encode(light)) - light) <= 2e-6f * std::abs(light) + 1e-7f);
}

TEST(Xyz, MatrixIsThePublishedOne) {
  // IEC 61966-2-1; it rounds the white's chromaticity to four decimals, which moves Z by 2e-4.
  const double published[3][3] = {
      {0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}};
  for (int i = 0; i < 3; ++i) {
    const Xyz xyz = xyz_from_rgb({double(i == 0), double(i == 1), double(i == 2)});
    EXPECT_NEAR(xyz.x, published[0][i], 3e-4);
    EXPECT_NEAR(xyz.y, published[1][i], 3e-4);
    EXPECT_NEAR(xyz.z, published[2][i], 3e-4);
  }
}

struct Published {
  LinearRgb rgb;
  Luv luv;
};

TEST(Luv, HasThePublishedValuesOfThePrimaries) {
  // CIE 1976 L*u*v* of the sRGB primaries and secondaries under D65, as colour calculators print them.
  const Published table[] = {{{1, 1, 1}, {100, 0, 0}},
                             {{1, 0, 0}, {53.241, 175.015, 37.756}},
                             {{0, 1, 0}, {87.735, -83.078, 107.399}},
                             {{0, 0, 1}, {32.297, -9.405, -130.342}},
                             {{1, 1, 0}, {97.139, 7.706, 106.787}},
                             {{0, 1, 1}, {91.113, -70.477, -15.202}},
                             {{1, 0, 1}, {60.324, 84.071, -108.683}}};
  for (const auto& [rgb, luv] : table) {
    const Luv found = luv_from_xyz(xyz_from_rgb(rgb));
    EXPECT_NEAR(found.l, luv.l, 0.01);
    EXPECT_NEAR(found.u, luv.u, 0.05);
    EXPECT_NEAR(found.v, luv.v, 0.05);
  }
}

TEST(Luv, GreyHasNoColourAndBlackIsTheOrigin) {
  for (double light : {1e-6, 0.001, 0.2, 1.0, 50.0}) {
    const Luv grey = luv_from_xyz(xyz_from_rgb({light, light, light}));
    EXPECT_NEAR(grey.u, 0, 1e-9 * (1 + grey.l));
    EXPECT_NEAR(grey.v, 0, 1e-9 * (1 + grey.l));
  }
  const Luv black = luv_from_xyz({0, 0, 0});
  EXPECT_EQ(black.l, 0);
  EXPECT_EQ(black.u, 0);
  EXPECT_EQ(black.v, 0);
}

TEST(Luv, IsLinearBelowTheKneeAndMeetsTheCubeRootThere) {
  EXPECT_NEAR(luv_from_xyz({0.95, 0.004, 1.09}).l, 903.3 * 0.004, 1e-12);
  EXPECT_NEAR(luv_from_xyz({1, 0.008856, 1}).l, luv_from_xyz({1, 0.0088561, 1}).l, 1e-3);
  EXPECT_NEAR(luv_from_xyz({1, 0.18418651851244416, 1}).l, 50, 1e-4);  // ((50 + 16) / 116)^3
}

TEST(Luv, TheWhitePointIsColourless) {
  for (const WhitePoint& white : {kWhiteD65, kWhiteA, kWhiteC}) {
    const Xyz light{white.x / white.y, 1, (1 - white.x - white.y) / white.y};
    const Luv luv = luv_from_xyz(light, white);
    EXPECT_NEAR(luv.u, 0, 1e-9);
    EXPECT_NEAR(luv.v, 0, 1e-9);
  }
}

TEST(Luv, AnotherWhiteOnlyShearsTheSpace) {
  const Xyz xyz = xyz_from_rgb({0.3, 0.5, 0.1});
  const Luv d65 = luv_from_xyz(xyz), a = luv_from_xyz(xyz, kWhiteA);
  EXPECT_DOUBLE_EQ(a.l, d65.l);
  EXPECT_NEAR(a.u - d65.u, 13 * a.l * (kWhiteD65.u_prime() - kWhiteA.u_prime()), 1e-9);
  EXPECT_NEAR(a.v - d65.v, 13 * a.l * (kWhiteD65.v_prime() - kWhiteA.v_prime()), 1e-9);
}

TEST(Luv, IsUnboundedAboveWhite) {
  EXPECT_NEAR(in_space(ColorSpace::kLuv, {1000, 1000, 1000})[0], 116 * 10 - 16, 1e-2);
  const Rgb sun = in_space(ColorSpace::kLuv, {5e4f, 5e4f, 4e4f});
  EXPECT_GT(sun[0], 4000);
  EXPECT_TRUE(std::isfinite(sun[1]) && std::isfinite(sun[2]));
}

RC_GTEST_PROP(Luv, XyzComesBack, ()) {
  const Xyz xyz = xyz_from_rgb({draw(1000, 1) + 1e-6, draw(1000, 1) + 1e-6, draw(1000, 20) + 1e-6});
  const WhitePoint white = *rc::gen::element(kWhiteD65, kWhiteA, kWhiteC, WhitePoint{0.25, 0.4});
  const Xyz back = xyz_from_luv(luv_from_xyz(xyz, white), white);
  for (auto [a, b] : {std::pair{xyz.x, back.x}, {xyz.y, back.y}, {xyz.z, back.z}})
    RC_ASSERT(std::abs(a - b) <= 1e-9 * (1 + std::abs(a)));
}

TEST(Hsv, HasTheHuesOfTheHexcone) {
  const struct {
    EncodedRgb rgb;
    Hsv hsv;
  } table[] = {{{1, 0, 0}, {0, 1, 1}},           {{1, 1, 0}, {1 / 6.0, 1, 1}},
               {{0, 1, 0}, {1 / 3.0, 1, 1}},     {{0, 0, 1}, {2 / 3.0, 1, 1}},
               {{1, 0, 0.5}, {11 / 12.0, 1, 1}}, {{0.5, 0.5, 0.5}, {0, 0, 0.5}},
               {{0, 0, 0}, {0, 0, 0}},           {{0.5, 0.25, 0.25}, {0, 0.5, 0.5}}};
  for (const auto& [rgb, hsv] : table) {
    const Hsv found = hsv_from_encoded(rgb);
    EXPECT_NEAR(found.h, hsv.h, 1e-12);
    EXPECT_NEAR(found.s, hsv.s, 1e-12);
    EXPECT_NEAR(found.v, hsv.v, 1e-12);
  }
}

RC_GTEST_PROP(Hsv, EncodedRgbComesBack, ()) {
  const EncodedRgb rgb{draw(255, 1), draw(255, 1), draw(255, 1)};
  const EncodedRgb back = encoded_from_hsv(hsv_from_encoded(rgb));
  RC_ASSERT(std::max({std::abs(back.r - rgb.r), std::abs(back.g - rgb.g), std::abs(back.b - rgb.b)}) < 1e-12);
}

TEST(Hsv, HueDifferenceWraps) {
  EXPECT_NEAR(hue_difference(0.95, 0.05), -0.1, 1e-12);
  EXPECT_NEAR(hue_difference(0.05, 0.95), 0.1, 1e-12);
  EXPECT_NEAR(hue_difference(0.2, 0.1), 0.1, 1e-12);
  EXPECT_NEAR(std::abs(hue_difference(0.75, 0.25)), 0.5, 1e-12);
}

RC_GTEST_PROP(Hsv, ConeDistanceIsTheWrappedHueDifference, ()) {
  const double ha = draw(1000, 1), hb = draw(1000, 1), s = draw(1000, 1), v = draw(1000, 1);
  const auto cone = [&](double h) {
    const LinearRgb rgb = decode(encoded_from_hsv({h, s, v}));
    return in_space(ColorSpace::kHsv, {float(rgb.r), float(rgb.g), float(rgb.b)});
  };
  const Rgb a = cone(ha), b = cone(hb);
  const double distance = std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  const double turn = hue_difference(ha, hb);
  RC_ASSERT(std::abs(distance - 2 * s * v * std::abs(std::sin(std::numbers::pi * turn))) < 2e-5);
}

RC_GTEST_PROP(ColorTransform, LinearRgbComesBackFromEverySpace, ()) {
  const double scale = *rc::gen::element(1.0, 0.01, 300.0);
  const Rgb rgb = draw_rgb(scale);
  const ColorSpace space = *rc::gen::elementOf(kSpaces);
  const ColorTransform transform(space, *rc::gen::element(kWhiteD65, kWhiteA));
  Rgb there, back;
  transform.from_rgb(rgb.data(), there.data());
  transform.to_rgb(there.data(), back.data());
  // A blue colour's red is a small difference of large terms: the error is of the colour, not the component.
  const float tolerance = 3e-5f * *std::max_element(rgb.begin(), rgb.end()) + 1e-7f;
  for (int i = 0; i < 3; ++i) RC_ASSERT(std::abs(back[i] - rgb[i]) <= tolerance);
}

RC_GTEST_PROP(ColorTransform, AgreesWithTheDoublePrecisionFormulas, ()) {
  const Rgb rgb = draw_rgb(1);
  const Rgb luv = in_space(ColorSpace::kLuv, rgb);
  const Luv exact = luv_from_xyz(xyz_from_rgb({rgb[0], rgb[1], rgb[2]}));
  RC_ASSERT(std::abs(luv[0] - exact.l) < 1e-3);
  RC_ASSERT(std::abs(luv[1] - exact.u) < 1e-3);
  RC_ASSERT(std::abs(luv[2] - exact.v) < 1e-3);
}

TEST(ColorTransform, StaysFiniteOutsideTheGamut) {
  const Rgb odd[] = {{-0.1f, -0.2f, -0.3f}, {-1, 0.5f, 0.2f}, {0, 0, 1e-38f}, {1e-30f, 0, 0}, {1e6f, 0, 0}};
  for (ColorSpace space : kSpaces)
    for (const Rgb& rgb : odd) {
      const Rgb there = in_space(space, rgb);
      for (float value : there) EXPECT_TRUE(std::isfinite(value)) << to_string(space);
    }
  const Rgb odd_luv[] = {{-5, 3, 3}, {0, 40, 40}, {50, 900, -900}, {1e-6f, 100, -100}};
  for (ColorSpace space : kSpaces)
    for (const Rgb& color : odd_luv) {
      Rgb rgb;
      ColorTransform(space).to_rgb(color.data(), rgb.data());
      for (float value : rgb) EXPECT_TRUE(std::isfinite(value)) << to_string(space);
    }
}

TEST(ColorTransform, ConvertsABlockLikeSinglePixels) {
  const float pixels[9] = {0.1f, 0.2f, 0.3f, 0.9f, 0.5f, 0, 0, 0, 0};
  for (ColorSpace space : kSpaces) {
    float block[9], back[9];
    std::copy(pixels, pixels + 9, block);
    ColorTransform(space).from_rgb_in_place(block, 3);
    for (int i = 0; i < 3; ++i) {
      const Rgb one = in_space(space, {pixels[3 * i], pixels[3 * i + 1], pixels[3 * i + 2]});
      for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(block[3 * i + c], one[c]);
    }
    std::copy(block, block + 9, back);
    ColorTransform(space).to_rgb_in_place(back, 3);
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(back[i], pixels[i], 1e-5);
  }
}

// Monte Carlo by rejection in the other direction: points of a box around the gamut in the space itself, of
// which the share that converts back to RGB in [0, 1]^3 is counted. It shares no formula with the integral of
// the .cc.
double sampled_gamut_volume(ColorSpace space, const double low[3], const double high[3], int count) {
  const ColorTransform transform(space);
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> unit(0, 1);
  int inside = 0;
  for (int i = 0; i < count; ++i) {
    float point[3], rgb[3], back[3];
    for (int c = 0; c < 3; ++c) point[c] = float(low[c] + (high[c] - low[c]) * unit(rng));
    transform.to_rgb(point, rgb);
    transform.from_rgb(rgb, back);
    bool is_inside = true;
    for (int c = 0; c < 3; ++c)
      is_inside &= rgb[c] >= 0 && rgb[c] <= 1 && std::abs(back[c] - point[c]) < 1e-3 * (high[c] - low[c]);
    inside += is_inside;
  }
  double box = 1;
  for (int c = 0; c < 3; ++c) box *= high[c] - low[c];
  return box * inside / count;
}

TEST(GamutVolume, IsWhatSamplingFinds) {
  // Luv fills about a sixth of its box: the standard error of 4e5 samples is 0.4 %, so 1.5 % is four of them.
  const double luv_low[3] = {0, -84, -135}, luv_high[3] = {100, 176, 108};
  const double luv = sampled_gamut_volume(ColorSpace::kLuv, luv_low, luv_high, 400000);
  EXPECT_NEAR(gamut_volume(ColorSpace::kLuv) / luv, 1, 0.015);
  const double cone_low[3] = {-1, -1, 0}, cone_high[3] = {1, 1, 1};
  const double hsv = sampled_gamut_volume(ColorSpace::kHsv, cone_low, cone_high, 400000);
  EXPECT_NEAR(gamut_volume(ColorSpace::kHsv) / hsv, 1, 0.015);
}

TEST(GamutDiameter, IsNotExceededByAnyPairAndIsReached) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<float> unit(0, 1);
  for (ColorSpace space : kSpaces) {
    double largest = 0;
    std::vector<Rgb> faces;  // most distant pairs lie on the cube's faces
    for (int i = 0; i < 600; ++i) {
      Rgb rgb{unit(rng), unit(rng), unit(rng)};
      rgb[i % 3] = i / 3 % 2;
      faces.push_back(in_space(space, rgb));
    }
    for (int i = 0; i < 8; ++i)
      faces.push_back(in_space(space, {float(i & 1), float(i >> 1 & 1), float(i >> 2)}));
    for (const Rgb& a : faces)
      for (const Rgb& b : faces)
        largest = std::max(largest, double(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2])));
    EXPECT_LE(largest, gamut_diameter(space) * 1.0001) << to_string(space);
    EXPECT_GT(largest, gamut_diameter(space) * 0.99) << to_string(space);
  }
}

TEST(DefaultNoise, IsThreeInLuvAndWorthTheSameEverywhere) {
  EXPECT_DOUBLE_EQ(default_noise(ColorSpace::kLuv), 3);
  const double p = unknown_color_likelihood(ColorSpace::kLuv, 3);
  EXPECT_GT(p, 0.0002);
  EXPECT_LT(p, 0.001);
  for (ColorSpace space : kSpaces)
    EXPECT_NEAR(unknown_color_likelihood(space, default_noise(space)), p, 1e-9) << to_string(space);
}

}  // namespace
}  // namespace roxel

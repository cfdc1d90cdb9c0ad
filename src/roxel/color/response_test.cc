#include "roxel/color/response.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const Response kResponses[] = {{ResponseCurve::kSrgb},
                               {ResponseCurve::kLinear},
                               {ResponseCurve::kGamma, 1.8},
                               {ResponseCurve::kGamma, 0.5}};

/// IEC 61966-2-1 in double precision, written out from the standard.
double iec_decode(double x) { return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4); }

/// The argument is rounded to float (2.4 * 6e-8), and so are the sum inside the power and its result.
constexpr double kFloatPowerError = 5e-7;

TEST(Response, SrgbTableIsTheStandardsPiecewiseCurve) {
  for (const int levels : {256, 65536}) {
    const auto table = decoding_table({ResponseCurve::kSrgb}, levels);
    ASSERT_EQ(table.size(), levels);
    for (int i = 0; i < levels; ++i) {
      const double expected = iec_decode(i / (levels - 1.0));
      ASSERT_NEAR(table[i], expected, kFloatPowerError * expected) << "level " << i << " of " << levels;
    }
  }
  EXPECT_NEAR(decode({ResponseCurve::kSrgb}, 0.5f), 0.21404114f, 1e-7f);
}

TEST(Response, EightBitCodesSurviveARoundTrip) {
  for (const Response& response : kResponses) {
    const auto table = decoding_table(response, 256);
    for (int i = 0; i < 256; ++i) EXPECT_EQ(encode_8bit(response, table[i]), i) << to_string(response);
  }
}

TEST(Response, GammaIsAPowerOddInItsArgument) {
  const Response response{ResponseCurve::kGamma, 2};
  EXPECT_FLOAT_EQ(decode(response, 0.5f), 0.25f);
  EXPECT_FLOAT_EQ(decode(response, -3.0f), -9.0f);
  EXPECT_FLOAT_EQ(encode(response, 9.0f), 3.0f);
}

RC_GTEST_PROP(Response, EncodeInvertsDecode, (int a)) {
  const float stored = (a % 30000) * 1e-4f;
  for (const Response& response : kResponses) {
    const float back = encode(response, decode(response, stored));
    RC_ASSERT(std::abs(back - stored) <= 2e-6f * std::abs(stored));
  }
}

TEST(Response, EightBitCodesAreClamped) {
  const Response srgb;
  EXPECT_EQ(encode_8bit(srgb, -1), 0);
  EXPECT_EQ(encode_8bit(srgb, 7), 255);
  EXPECT_EQ(encode_8bit(srgb, std::numeric_limits<float>::infinity()), 255);
  EXPECT_EQ(encode_8bit(srgb, std::nanf("")), 0);
}

TEST(Response, TextIsReadAndWritten) {
  for (const Response& response : kResponses) EXPECT_EQ(parse_response(to_string(response)), response);
  EXPECT_EQ(parse_response("gamma:2.2"), (Response{ResponseCurve::kGamma, 2.2}));
  for (const char* bad :
       {"", "sRGB", "gamma", "gamma:", "gamma:x", "gamma:2.2x", "gamma:0", "gamma:-1", "gamma:nan"})
    EXPECT_THAT([&] { parse_response(bad, "--response"); },
                ThrowsMessage<InvalidInput>(HasSubstr(std::string("--response: found '") + bad + "'")));
}

}  // namespace
}  // namespace roxel

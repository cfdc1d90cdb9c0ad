#include "roxel/color/white_point.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "roxel/base/error.h"

namespace roxel {
namespace {

TEST(WhitePoint, HasThePublishedUniformChromaticity) {
  EXPECT_NEAR(kWhiteD65.u_prime(), 0.19784, 1e-5);
  EXPECT_NEAR(kWhiteD65.v_prime(), 0.46834, 1e-5);
  EXPECT_NEAR(kWhiteC.u_prime(), 0.2009, 1e-4);
  EXPECT_NEAR(kWhiteC.v_prime(), 0.4610, 2e-4);
  EXPECT_NEAR(kWhiteA.u_prime(), 0.2560, 1e-4);
  EXPECT_NEAR(kWhiteA.v_prime(), 0.5243, 1e-4);
}

TEST(WhitePoint, ParsesNamesAndChromaticities) {
  EXPECT_EQ(parse_white_point("D65"), kWhiteD65);
  EXPECT_EQ(parse_white_point("d65"), kWhiteD65);
  EXPECT_EQ(parse_white_point("a"), kWhiteA);
  EXPECT_EQ(parse_white_point("C"), kWhiteC);
  EXPECT_EQ(parse_white_point("0.31,0.33"), (WhitePoint{0.31, 0.33}));
}

TEST(WhitePoint, TextRoundTrips) {
  for (const WhitePoint& white : {kWhiteD65, kWhiteA, kWhiteC, WhitePoint{0.1 + 0.2, 1.0 / 3}})
    EXPECT_EQ(parse_white_point(to_string(white)), white);
}

TEST(WhitePoint, RefusesWhatIsNoChromaticity) {
  for (const char* text : {"", "D50", "0.3", "0.3,", ",0.3", "0.3,0.3,0.3", "0.5,0.5", "0,0.3", "-0.1,0.3",
                           "nan,0.3", "0.3,inf", "0.3, 0.3", "0.3,0.3x"})
    EXPECT_THROW(parse_white_point(text), InvalidInput) << text;
}

TEST(WhitePoint, NamesTheOptionAndTheTextInItsError) {
  try {
    parse_white_point("D50", "--white-point");
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_THAT(error.what(),
                testing::AllOf(testing::HasSubstr("--white-point"), testing::HasSubstr("'D50'")));
  }
}

}  // namespace
}  // namespace roxel

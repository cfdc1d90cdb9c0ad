#include "roxel/base/error.h"

#include <gtest/gtest.h>

namespace roxel {
namespace {

template <class Exception, class Action>
std::string message_of(Action action) {
  try {
    action();
  } catch (const Exception& error) {
    return error.what();
  }
  return "(nothing thrown)";
}

TEST(Error, InvalidInputNamesPlaceFoundAndExpected) {
  EXPECT_EQ(message_of<InvalidInput>([] { throw_invalid("cameras.txt:3", "-1", "a positive focal length"); }),
            "cameras.txt:3: found -1, expected a positive focal length");
}

TEST(Error, ChecksThrowWithBothValues) {
  const int three = 3;
  const std::string text = message_of<std::logic_error>([&] { ROXEL_CHECK_EQ(three, 4); });
  EXPECT_NE(text.find("three == 4 (3 vs 4)"), std::string::npos) << text;
  EXPECT_NE(text.find("error_test.cc:"), std::string::npos) << text;
  EXPECT_THROW(ROXEL_CHECK(three == 4), std::logic_error);
  EXPECT_THROW(ROXEL_CHECK_LT(three, 3), std::logic_error);
  EXPECT_THROW(ROXEL_CHECK_LE(three, 2), std::logic_error);
  EXPECT_THROW(ROXEL_CHECK_GE(three, 4), std::logic_error);
}

TEST(Error, ChecksThatHoldEvaluateOnceAndPass) {
  int calls = 0;
  EXPECT_NO_THROW(ROXEL_CHECK(++calls == 1));
  EXPECT_NO_THROW(ROXEL_CHECK_EQ(++calls, 2));
  EXPECT_EQ(calls, 2);
}

TEST(Error, CausesAreTypesOfTheirOwn) {
  static_assert(!std::is_base_of_v<InvalidInput, IoError> && !std::is_base_of_v<IoError, InvalidInput>);
  static_assert(!std::is_base_of_v<InvalidInput, Cancelled> && !std::is_base_of_v<IoError, Cancelled>);
  EXPECT_STREQ(Cancelled().what(), "interrupted");
}

}  // namespace
}  // namespace roxel

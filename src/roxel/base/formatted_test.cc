#include "roxel/base/formatted.h"

#include <gtest/gtest.h>

namespace roxel {
namespace {

TEST(Formatted, IsWhatPrintfPrints) {
  EXPECT_EQ(formatted("%s %d %.2f %%", "a", -3, 0.125), "a -3 0.12 %");
  EXPECT_EQ(formatted("%s", ""), "");
}

TEST(Formatted, HasNoLargestLength) {
  const std::string word(5000, 'x');
  EXPECT_EQ(formatted("<%s>", word.c_str()), "<" + word + ">");
}

}  // namespace
}  // namespace roxel

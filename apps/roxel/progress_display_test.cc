#include "progress_display.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace roxel::cli {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(ProgressLine, SaysStageShareLevelAndPass) {
  const std::string line = progress_line({"volume", 2, 3, 5, 8, 0.5}, 0.5);
  EXPECT_EQ(line, "volume [" + std::string(15, '#') + std::string(15, ' ') + "]  50 %  level 2/3, pass 5/8");
}

TEST(ProgressLine, SaysTheTimeThatIsLeft) {
  // A quarter took half a minute: three quarters take a minute and a half.
  EXPECT_THAT(progress_line({"depth", 0, 0, 0, 0, 0.25}, 30), HasSubstr(" 25 %, about 1 min 30 s left"));
}

TEST(ProgressLine, GuessesNoTimeFromNextToNothingAndNoneAtTheEnd) {
  EXPECT_THAT(progress_line({"volume", 1, 3, 1, 8, 0.01}, 30), Not(HasSubstr("left")));
  EXPECT_THAT(progress_line({"volume", 1, 3, 1, 8, 0.25}, 0.2), Not(HasSubstr("left")));
  EXPECT_THAT(progress_line({"volume", 3, 3, 8, 8, 1}, 30), Not(HasSubstr("left")));
}

}  // namespace
}  // namespace roxel::cli

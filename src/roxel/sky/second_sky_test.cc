#include "roxel/sky/second_sky.h"

#include <gtest/gtest.h>

namespace roxel {
namespace {

constexpr SkyOutcome kFirst{SkyModel::kPerez, 0.30, 0.010};

TEST(WhyRefused, ASecondSkyThatHasMoreAndFitsAsWellIsNot) {
  EXPECT_EQ(why_refused(kFirst, {SkyModel::kPerez, 0.303, 0.010}, 1), "");
  EXPECT_EQ(why_refused(kFirst, {SkyModel::kPerez, 0.40, 0.0129}, 0.951), "");
  EXPECT_EQ(why_refused({SkyModel::kPublished, 0.05, 0.05}, {SkyModel::kPerez, 0.3, 0.02}, 1), "");
  EXPECT_EQ(why_refused({SkyModel::kNone, 0, 0}, {SkyModel::kPerez, 0.3, 0.02}, 1), "");
}

TEST(WhyRefused, SaysWhatIsWrong) {
  EXPECT_EQ(why_refused(kFirst, {SkyModel::kNone, 0.5, 0}, 1), "it has no light");
  EXPECT_EQ(why_refused(kFirst, {SkyModel::kPerez, 0.3019, 0.01}, 1), "hardly more sky");
  EXPECT_EQ(why_refused(kFirst, {SkyModel::kPerez, 0.40, 0.01}, 0.94),
            "it has but 94 % of the sky of the first");
  EXPECT_EQ(why_refused(kFirst, {SkyModel::kPublished, 0.40, 0.01}, 1), "its model is but published");
  EXPECT_EQ(why_refused(kFirst, {SkyModel::kPerez, 0.40, 0.0131}, 1),
            "its fit is worse: 1.3 instead of 1.0 %");
}

TEST(SkyKept, CountsWhatOfTheFirstIsLeft) {
  SkyKept kept;
  EXPECT_EQ(kept.share(), 1);
  kept.add({}, Mask(2, 1, 255));  // no sky before: nothing to lose
  EXPECT_EQ(kept.share(), 1);
  Mask first(2, 2, 0), second(2, 2, 255);
  first.at(0, 0) = 200, first.at(1, 0) = 100;
  second.at(1, 0) = 25;
  kept.add(first, second);
  EXPECT_NEAR(kept.share(), 0.75, 1e-12);
  kept.add(Mask(1, 1, 100), {});
  EXPECT_NEAR(kept.share(), 225.0 / 400, 1e-12);
}

}  // namespace
}  // namespace roxel

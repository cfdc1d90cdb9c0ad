#include "roxel/base/run_context.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <thread>
#include <vector>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"

namespace roxel {
namespace {

Progress at(double fraction) {
  Progress progress;
  progress.fraction = fraction;
  return progress;
}

TEST(RunContext, ProgressIsMonotoneAndBetweenZeroAndOne) {
  std::vector<double> heard;
  RunContext context(1, [&](const Progress& p) { heard.push_back(p.fraction); });
  for (const double fraction : {-0.5, 0.2, 0.1, 0.7, std::numeric_limits<double>::quiet_NaN(), 3.0, 0.9})
    context.report(at(fraction));
  EXPECT_EQ(heard, (std::vector<double>{0, 0.2, 0.2, 0.7, 0.7, 1, 1}));
}

TEST(RunContext, PassesOnWhatWasReported) {
  Progress heard;
  RunContext context(1, [&](const Progress& p) { heard = p; });
  context.report(
      {.stage = "depth", .level = 2, .level_count = 3, .pass = 4, .pass_limit = 8, .fraction = 0.5});
  EXPECT_EQ(heard.stage, "depth");
  EXPECT_EQ(heard.level, 2);
  EXPECT_EQ(heard.level_count, 3);
  EXPECT_EQ(heard.pass, 4);
  EXPECT_EQ(heard.pass_limit, 8);
}

TEST(RunContext, ReportsOfManyThreadsAreSerialisedAndMonotone) {
  int inside = 0;  // not atomic on purpose: reports must exclude each other
  int overlaps = 0;
  std::vector<double> heard;
  RunContext context(4, [&](const Progress& p) {
    overlaps += inside++;
    heard.push_back(p.fraction);
    std::this_thread::yield();
    --inside;
  });
  parallel_for(2000, 4, [&](std::int64_t i, int) { context.report(at(i / 1999.0)); });
  EXPECT_EQ(overlaps, 0);
  ASSERT_EQ(heard.size(), 2000u);
  EXPECT_TRUE(std::is_sorted(heard.begin(), heard.end()));
  EXPECT_EQ(heard.back(), 1);
}

TEST(RunContext, AThrowingListenerDoesNotBlockTheNextReport) {
  int calls = 0;
  RunContext context(1, [&](const Progress&) {
    if (++calls == 1) throw std::runtime_error("listener");
  });
  EXPECT_THROW(context.report(at(0.1)), std::runtime_error);
  context.report(at(0.2));
  EXPECT_EQ(calls, 2);
}

TEST(RunContext, CancelFromAnotherThreadEndsALoop) {
  RunContext context(2);
  EXPECT_FALSE(context.cancelled());
  EXPECT_NO_THROW(context.throw_if_cancelled());
  std::atomic<bool> begun{false};
  std::thread other([&] {
    while (!begun) std::this_thread::yield();
    context.cancel();
  });
  const auto endless = [&](std::int64_t, int) {
    begun = true;
    context.throw_if_cancelled();
  };
  EXPECT_THROW(parallel_for(std::numeric_limits<std::int64_t>::max() / 2, 2, endless), Cancelled);
  other.join();
  EXPECT_TRUE(context.cancelled());
}

TEST(RunContext, CountsThreads) {
  EXPECT_EQ(RunContext(3).thread_count(), 3);
  EXPECT_GE(RunContext(0).thread_count(), 1);
  EXPECT_GE(RunContext(-1).thread_count(), 1);
}

}  // namespace
}  // namespace roxel

#include "roxel/base/parallel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <vector>

namespace roxel {
namespace {

class ParallelFor : public testing::TestWithParam<int> {};

TEST_P(ParallelFor, VisitsEveryIndexOnce) {
  for (const int count : {0, 1, 2, 7, 1000}) {
    std::vector<std::atomic<int>> visits(count);
    parallel_for(count, GetParam(), [&](std::int64_t i, int) { ++visits[i]; });
    for (int i = 0; i < count; ++i) ASSERT_EQ(visits[i], 1) << i << " of " << count;
  }
}

TEST_P(ParallelFor, NeverSharesAWorker) {
  const int threads = GetParam();
  std::vector<std::atomic<int>> busy(threads);
  std::atomic<bool> shared{false}, outside{false};
  parallel_for(300, threads, [&](std::int64_t, int worker) {
    if (worker < 0 || worker >= threads) {
      outside = true;
      return;
    }
    if (busy[worker]++ != 0) shared = true;
    std::this_thread::sleep_for(std::chrono::microseconds(50));
    --busy[worker];
  });
  EXPECT_FALSE(shared);
  EXPECT_FALSE(outside);
}

TEST_P(ParallelFor, RethrowsAndStops) {
  std::atomic<int> running{0}, finished{0};
  const auto body = [&](std::int64_t i, int) {
    ++running;
    if (i == 5) {
      --running;
      throw std::runtime_error("five");
    }
    ++finished;
    --running;
  };
  try {
    parallel_for(1'000'000'000'000, GetParam(), body);
    FAIL() << "nothing thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "five");
  }
  EXPECT_EQ(running, 0);
  EXPECT_GE(finished, 5);  // indices are handed out in order, so those before had begun
}

TEST_P(ParallelFor, GivesTheSameResultForAnyNumberOfThreads) {
  const auto collatz_steps = [](std::int64_t n) {
    int steps = 0;
    for (; n != 1; ++steps) n = n % 2 ? 3 * n + 1 : n / 2;
    return steps;
  };
  std::vector<int> serial(5000), parallel(5000);
  for (int i = 0; i < 5000; ++i) serial[i] = collatz_steps(i + 1);
  parallel_for(5000, GetParam(), [&](std::int64_t i, int) { parallel[i] = collatz_steps(i + 1); });
  EXPECT_EQ(parallel, serial);
}

TEST_P(ParallelFor, NestsInItself) {
  std::atomic<int> calls{0};
  parallel_for(8, GetParam(),
               [&](std::int64_t, int) { parallel_for(16, GetParam(), [&](std::int64_t, int) { ++calls; }); });
  EXPECT_EQ(calls, 128);
}

TEST_P(ParallelFor, BlocksCoverTheRangeInWholeGrains) {
  for (const std::int64_t grain : {1, 3, 64, 1000}) {
    std::vector<std::atomic<int>> visits(100);
    parallel_for_blocks(100, grain, GetParam(), [&](std::int64_t begin, std::int64_t end, int) {
      EXPECT_EQ(begin % grain, 0);
      EXPECT_EQ(end, std::min<std::int64_t>(100, begin + grain));
      for (auto i = begin; i < end; ++i) ++visits[i];
    });
    for (const auto& count : visits) ASSERT_EQ(count, 1);
  }
}

TEST(ParallelForArguments, MeaninglessOnesDoNoHarm) {
  int calls = 0;
  parallel_for(-3, 2, [&](std::int64_t, int) { ++calls; });
  EXPECT_EQ(calls, 0);
  parallel_for(3, 0, [&](std::int64_t, int) { ++calls; });
  EXPECT_EQ(calls, 3);
  EXPECT_THROW(parallel_for_blocks(3, 0, 2, [](std::int64_t, std::int64_t, int) {}), std::logic_error);
}

TEST_P(ParallelFor, RunsAsManyWorkersAsItIsTold) {
  // Each index waits for all others to begin; with fewer workers this would run into the time limit.
  const int threads = GetParam();
  std::atomic<int> begun{0};
  std::atomic<bool> met{true};
  parallel_for(threads, threads, [&](std::int64_t, int) {
    ++begun;
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (begun < threads && met)
      if (std::chrono::steady_clock::now() > deadline) met = false;
  });
  EXPECT_TRUE(met);
}

TEST_P(ParallelFor, PreparedThingsAreVisitedInOrderAndFewAtOnce) {
  struct Counted {
    Counted(std::int64_t i, std::atomic<int>* counter) : index(i), alive(counter) { ++*alive; }
    Counted(Counted&& other) noexcept : index(other.index), alive(other.alive) { ++*alive; }
    ~Counted() { --*alive; }
    std::int64_t index;
    std::atomic<int>* alive;
  };
  std::atomic<int> alive{0};
  std::int64_t next = 0;
  constexpr int kMost = 3;
  for_each_prepared(
      23, kMost, GetParam(), [&](std::int64_t i) { return Counted(i, &alive); },
      [&](std::int64_t i, const Counted& thing) {
        EXPECT_EQ(i, next++);
        EXPECT_EQ(thing.index, i);
        EXPECT_LE(alive, std::min(GetParam(), kMost));
      });
  EXPECT_EQ(next, 23);
  EXPECT_EQ(alive, 0);
}

INSTANTIATE_TEST_SUITE_P(Threads, ParallelFor, testing::Values(1, 2, 4));

}  // namespace
}  // namespace roxel

#include "roxel/base/peak_memory.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <memory>
#include <vector>

namespace roxel {
namespace {

constexpr std::int64_t kMiB = std::int64_t{1} << 20;

/// Holds so many resident bytes for a moment.
void hold(std::int64_t bytes) {
  const auto size = static_cast<std::size_t>(bytes);
  void* memory = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  std::memset(memory, 1, size);
  munmap(memory, size);
}

bool marks_start_anew() { return access("/proc/self/clear_refs", W_OK) == 0; }

TEST(PeakMemory, OfAStretchIsNeitherThatBeforeNorThatWithin) {
  if (!marks_start_anew()) GTEST_SKIP() << "/proc/self/clear_refs cannot be written";
  PeakMemory all;
  hold(300 * kMiB);
  const std::int64_t large = all.bytes();
  EXPECT_GT(large, 300 * kMiB);

  PeakMemory within;
  EXPECT_LT(within.bytes(), large - 200 * kMiB);
  hold(100 * kMiB);
  EXPECT_GT(within.bytes(), 100 * kMiB);
  EXPECT_LT(within.bytes(), large - 100 * kMiB);

  within.restart();
  EXPECT_LT(within.bytes(), large - 200 * kMiB);
  // The one around remembers what there was before the other began.
  EXPECT_GE(all.bytes(), large);
  EXPECT_GE(peak_memory_bytes(), large);
}

TEST(PeakMemory, OfTheOneAroundHasWhatIsHeldWithin) {
  if (!marks_start_anew()) GTEST_SKIP() << "/proc/self/clear_refs cannot be written";
  PeakMemory all;
  {
    const PeakMemory within;
    hold(200 * kMiB);
  }
  const PeakMemory after;
  EXPECT_GT(all.bytes(), 200 * kMiB);
  EXPECT_LT(after.bytes(), all.bytes() - 100 * kMiB);
}

TEST(PeakMemory, WhatWasFreedBeforeIsNoPartOfIt) {
#if !defined(__GLIBC__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "this allocator keeps what was freed";
#endif
  if (!marks_start_anew()) GTEST_SKIP() << "/proc/self/clear_refs cannot be written";
  // Pieces of a few kilobytes stay with the allocator when they are freed, if one behind them is in use.
  constexpr std::size_t kPieces = 25'000, kSize = 4000;
  std::vector<std::unique_ptr<char[]>> pieces;
  for (std::size_t i = 0; i < kPieces; ++i) {
    pieces.push_back(std::make_unique_for_overwrite<char[]>(kSize));
    std::memset(pieces.back().get(), 1, kSize);
  }
  const PeakMemory with;
  const std::unique_ptr<char[]> last = std::make_unique<char[]>(kSize);
  pieces.clear();
  const PeakMemory after;
  EXPECT_LT(after.bytes(), with.bytes() - static_cast<std::int64_t>(kPieces * kSize / 2));
}

TEST(PeakMemory, IsNotKnownWhereTheMarkCannotStartAnew) {
  const PeakMemory stretch;
  EXPECT_EQ(stretch.bytes() > 0, marks_start_anew());
  EXPECT_GT(peak_memory_bytes(), 0);
}

}  // namespace
}  // namespace roxel

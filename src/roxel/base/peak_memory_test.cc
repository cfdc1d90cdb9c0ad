#include "roxel/base/peak_memory.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>

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

TEST(PeakMemory, IsNotKnownWhereTheMarkCannotStartAnew) {
  const PeakMemory stretch;
  EXPECT_EQ(stretch.bytes() > 0, marks_start_anew());
  EXPECT_GT(peak_memory_bytes(), 0);
}

}  // namespace
}  // namespace roxel

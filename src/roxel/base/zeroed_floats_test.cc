#include "roxel/base/zeroed_floats.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace roxel {
namespace {

TEST(ZeroedFloats, AreZerosFromTheBeginningOfALine) {
  // Of a few bytes, which come from the heap, and of several large pages; what was there before is gone.
  for (const std::size_t count : {1, 100, 3'000'000})
    for (int again = 0; again < 2; ++again) {
      const ZeroedFloats numbers(count);
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(numbers.data()) % (ZeroedFloats::kLine * sizeof(float)), 0u);
      std::size_t others = 0;
      for (std::size_t i = 0; i < count; ++i) {
        others += numbers.data()[i] != 0;
        numbers.data()[i] = 1;
      }
      EXPECT_EQ(others, 0u);
    }
}

}  // namespace
}  // namespace roxel

#pragma once
/// Exponentials as plain arithmetic without branches, so that the loops around them vectorise.

#include <bit>
#include <cstdint>

namespace roxel {

namespace internal {

/// 2^n and 2^f - 1 for y = n + f <= 0 with |f| <= 1/2, by the series of 2^f - 1 to degree 6.
struct PowerOfTwo {
  float whole;
  float fraction_less_one;
};
inline __attribute__((always_inline)) PowerOfTwo power_of_two(float y) {
  const int n = static_cast<int>(y - 0.5f);  // y <= 0: truncation rounds to the nearest
  const float f = y - static_cast<float>(n);
  float s = 1.540353039e-4f;
  s = s * f + 1.333355814e-3f;
  s = s * f + 9.618129107e-3f;
  s = s * f + 5.550410866e-2f;
  s = s * f + 2.402265070e-1f;
  s = s * f + 6.931471806e-1f;
  return {std::bit_cast<float>((n + 127) << 23), s * f};
}

}  // namespace internal

/// exp(x) for x <= 0, relative error below 1e-6; exp(-87), about 1.6e-38, below -87.
inline __attribute__((always_inline)) float exp_negative(float x) {
  const auto power = internal::power_of_two((x < -87.0f ? -87.0f : x) * 1.44269504088896341f);
  return power.whole * power.fraction_less_one + power.whole;
}

/// 1 - exp(-x) for x >= 0, relative error below 1e-6, small x too.
inline __attribute__((always_inline)) float one_minus_exp(float x) {
  const auto power = internal::power_of_two((x > 87.0f ? -87.0f : -x) * 1.44269504088896341f);
  return (1.0f - power.whole) - power.whole * power.fraction_less_one;
}

}  // namespace roxel

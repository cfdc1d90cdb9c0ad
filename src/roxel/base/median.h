#pragma once
/// The middle one of some numbers.

#include <algorithm>
#include <cstddef>
#include <vector>

namespace roxel {

/// Of an even number of them the greater of the middle two; 0 where there are none. Their order is lost.
template <class Number>
Number median(std::vector<Number>& numbers) {
  if (numbers.empty()) return 0;
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
}

}  // namespace roxel

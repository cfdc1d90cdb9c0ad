#pragma once
/// Eight numbers side by side, as the compiler's vectors: one register with AVX2, two without. Arithmetic,
/// comparisons (all bits set where true) and `mask ? a : b` work lane by lane. For use inside ROXEL_KERNEL
/// functions, whose inlined parts are compiled for the same machine; passed by reference, never by value.

#include <cstdint>

namespace roxel {

inline constexpr int kLanes = 8;
using Floats = float __attribute__((vector_size(4 * kLanes)));
using Ints = std::int32_t __attribute__((vector_size(4 * kLanes)));
using FourFloats = float __attribute__((vector_size(16)));

/// Reads and writes without any demand on alignment, and whatever type of four bytes lies there.
template <class Vector, class Element>
inline __attribute__((always_inline)) void load(const Element* from, Vector& to) {
  using Anywhere __attribute__((aligned(4), may_alias)) = Vector;
  to = *reinterpret_cast<const Anywhere*>(from);
}
template <class Vector, class Element>
inline __attribute__((always_inline)) void store(const Vector& from, Element* to) {
  using Anywhere __attribute__((aligned(4), may_alias)) = Vector;
  *reinterpret_cast<Anywhere*>(to) = from;
}

/// first[lane] = from[at[lane]], second[lane] = from[at[lane] + 1].
inline __attribute__((always_inline)) void load_pairs(const float* from, const std::int32_t at[kLanes],
                                                      Floats& first, Floats& second) {
  using Pairs = double __attribute__((vector_size(32)));  // only carried
  using Pair __attribute__((aligned(4), may_alias)) = double;
  const auto pair = [&](int lane) __attribute__((always_inline)) {
    return *reinterpret_cast<const Pair*>(from + at[lane]);
  };
  const Pairs low = {pair(0), pair(1), pair(2), pair(3)}, high = {pair(4), pair(5), pair(6), pair(7)};
  const Floats a = reinterpret_cast<Floats>(low), b = reinterpret_cast<Floats>(high);
  first = __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14);
  second = __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15);
}

/// rows[i][j] <-> rows[j][i].
inline __attribute__((always_inline)) void transpose(Floats rows[kLanes]) {
  Floats a[kLanes], b[kLanes];
#pragma GCC unroll 4
  for (int i = 0; i < kLanes; i += 2) {
    a[i] = __builtin_shufflevector(rows[i], rows[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    a[i + 1] = __builtin_shufflevector(rows[i], rows[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
#pragma GCC unroll 2
  for (int i = 0; i < kLanes; i += 4)
#pragma GCC unroll 2
    for (int j = 0; j < 2; ++j) {
      b[i + 2 * j] = __builtin_shufflevector(a[i + j], a[i + 2 + j], 0, 1, 8, 9, 4, 5, 12, 13);
      b[i + 2 * j + 1] = __builtin_shufflevector(a[i + j], a[i + 2 + j], 2, 3, 10, 11, 6, 7, 14, 15);
    }
#pragma GCC unroll 4
  for (int i = 0; i < kLanes / 2; ++i) {
    rows[i] = __builtin_shufflevector(b[i], b[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    rows[i + 4] = __builtin_shufflevector(b[i], b[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

/// columns[c][lane] = rows[lane][c].
inline __attribute__((always_inline)) void transpose(const FourFloats rows[kLanes], Floats columns[4]) {
  Floats pairs[4];  // rows i and i + 4
#pragma GCC unroll 4
  for (int i = 0; i < 4; ++i)
    pairs[i] = __builtin_shufflevector(rows[i], rows[i + 4], 0, 1, 2, 3, 4, 5, 6, 7);
  const Floats a = __builtin_shufflevector(pairs[0], pairs[1], 0, 8, 1, 9, 4, 12, 5, 13);
  const Floats b = __builtin_shufflevector(pairs[0], pairs[1], 2, 10, 3, 11, 6, 14, 7, 15);
  const Floats c = __builtin_shufflevector(pairs[2], pairs[3], 0, 8, 1, 9, 4, 12, 5, 13);
  const Floats d = __builtin_shufflevector(pairs[2], pairs[3], 2, 10, 3, 11, 6, 14, 7, 15);
  columns[0] = __builtin_shufflevector(a, c, 0, 1, 8, 9, 4, 5, 12, 13);
  columns[1] = __builtin_shufflevector(a, c, 2, 3, 10, 11, 6, 7, 14, 15);
  columns[2] = __builtin_shufflevector(b, d, 0, 1, 8, 9, 4, 5, 12, 13);
  columns[3] = __builtin_shufflevector(b, d, 2, 3, 10, 11, 6, 7, 14, 15);
}

}  // namespace roxel

#pragma once
/// Random numbers of one pixel: a pure function of the pixel and the seed, hence the same on any thread.

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "roxel/synth/noise.h"

namespace roxel {

/// The k-th of a sequence of points that fill the unit square evenly [Roberts18], moved by `shift` with
/// wrap-around.
inline Eigen::Vector2f even_point(int k, const Eigen::Vector2f& shift = {0.5f, 0.5f}) {
  const double x = shift.x() + 0.7548776662466927 * k, y = shift.y() + 0.5698402909980532 * k;
  return {static_cast<float>(x - std::floor(x)), static_cast<float>(y - std::floor(y))};
}

class SampleStream {
 public:
  SampleStream(int x, int y, int image, std::uint32_t seed) : key_(lattice_hash(x, y, image, seed)) {}

  std::uint32_t bits() {
    return lattice_hash(static_cast<int>(key_), static_cast<int>(++count_), 0, 0x51edu);
  }
  /// In [0, 1).
  float number() { return static_cast<float>(bits() >> 8) * (1.0f / 16777216.0f); }
  Eigen::Vector2f pair() {
    const float a = number();
    return {a, number()};
  }

  /// `count` evenly spread pairs in random order at a random shift.
  void even_pairs(int count, std::vector<Eigen::Vector2f>& pairs) {
    const Eigen::Vector2f shift = pair();
    pairs.resize(static_cast<std::size_t>(count));
    for (int k = 0; k < count; ++k) pairs[k] = even_point(k, shift);
    for (int k = count - 1; k > 0; --k)
      std::swap(pairs[k], pairs[bits() % static_cast<std::uint32_t>(k + 1)]);
  }

 private:
  std::uint32_t key_;
  std::uint32_t count_ = 0;
};

}  // namespace roxel

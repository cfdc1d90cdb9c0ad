#pragma once
/// Procedural randomness that is a pure function of position and seed, hence the same in any order and on any
/// number of threads.

#include <Eigen/Core>
#include <cstdint>

namespace roxel {

/// A well mixed 32-bit hash of three lattice coordinates and a seed: odd multipliers spread them, rounds of
/// multiply and shift mix the bits.
inline std::uint32_t lattice_hash(int x, int y, int z, std::uint32_t seed) {
  std::uint32_t h = seed * 0x9e3779b9u + static_cast<std::uint32_t>(x) * 0x85ebca6bu +
                    static_cast<std::uint32_t>(y) * 0xc2b2ae35u + static_cast<std::uint32_t>(z) * 0x27d4eb2fu;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 12;
  h *= 0x297a2d39u;
  h ^= h >> 15;
  return h;
}

/// The same as a number in [0, 1).
inline float lattice_random(int x, int y, int z, std::uint32_t seed) {
  return static_cast<float>(lattice_hash(x, y, z, seed) >> 8) * (1.0f / 16777216.0f);
}

/// Smooth noise in [-1, 1], twice differentiable, one feature a unit; slope at most about 4.
float value_noise(const Eigen::Vector3f& p, std::uint32_t seed);

/// Sum of `octaves` noises, each of twice the frequency and half the height of the one before; in [-1, 1].
float fractal_noise(const Eigen::Vector3f& p, int octaves, std::uint32_t seed);

}  // namespace roxel

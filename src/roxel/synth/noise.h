#pragma once
/// Procedural randomness that is a pure function of position and seed, hence the same in any order and on any
/// number of threads.

#include <Eigen/Core>
#include <cstdint>

namespace roxel {

/// A well mixed 32-bit hash of three lattice coordinates and a seed.
std::uint32_t lattice_hash(int x, int y, int z, std::uint32_t seed);

/// The same as a number in [0, 1).
float lattice_random(int x, int y, int z, std::uint32_t seed);

/// Smooth noise in [-1, 1], twice differentiable, one feature a unit; slope at most about 4.
float value_noise(const Eigen::Vector3f& p, std::uint32_t seed);

/// Sum of `octaves` noises, each of twice the frequency and half the height of the one before; in [-1, 1].
float fractal_noise(const Eigen::Vector3f& p, int octaves, std::uint32_t seed);

}  // namespace roxel

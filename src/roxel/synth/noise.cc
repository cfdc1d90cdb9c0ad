#include "roxel/synth/noise.h"

namespace roxel {
namespace {

// std::floor is a function call on plain x86-64.
int floor_int(float x) {
  const int truncated = static_cast<int>(x);
  return truncated - (static_cast<float>(truncated) > x);
}

}  // namespace

// Three odd multipliers spread the coordinates, two rounds of multiply and shift mix the bits.
std::uint32_t lattice_hash(int x, int y, int z, std::uint32_t seed) {
  std::uint32_t h = seed * 0x9e3779b9u + static_cast<std::uint32_t>(x) * 0x85ebca6bu +
                    static_cast<std::uint32_t>(y) * 0xc2b2ae35u + static_cast<std::uint32_t>(z) * 0x27d4eb2fu;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 12;
  h *= 0x297a2d39u;
  h ^= h >> 15;
  return h;
}

float lattice_random(int x, int y, int z, std::uint32_t seed) {
  return static_cast<float>(lattice_hash(x, y, z, seed) >> 8) * (1.0f / 16777216.0f);
}

float value_noise(const Eigen::Vector3f& p, std::uint32_t seed) {
  int cell[3];
  float s[3];
  for (int i = 0; i < 3; ++i) {
    cell[i] = floor_int(p[i]);
    const float t = p[i] - static_cast<float>(cell[i]);
    s[i] = t * t * t * (t * (6 * t - 15) + 10);
  }
  const auto at = [&](int i, int j, int k) {
    return lattice_random(cell[0] + i, cell[1] + j, cell[2] + k, seed);
  };
  const auto along_x = [&](int j, int k) { return at(0, j, k) + s[0] * (at(1, j, k) - at(0, j, k)); };
  const auto along_y = [&](int k) {
    const float a = along_x(0, k);
    return a + s[1] * (along_x(1, k) - a);
  };
  const float a = along_y(0);
  return 2 * (a + s[2] * (along_y(1) - a)) - 1;
}

float fractal_noise(const Eigen::Vector3f& p, int octaves, std::uint32_t seed) {
  float sum = 0, height = 1, total = 0, frequency = 1;
  for (int i = 0; i < octaves; ++i) {
    sum += height * value_noise(frequency * p, seed + static_cast<std::uint32_t>(i));
    total += height;
    height *= 0.5f;
    frequency *= 2.03f;  // not exactly 2: lattices of the octaves do not coincide
  }
  return sum / total;
}

}  // namespace roxel

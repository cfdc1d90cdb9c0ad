#include "roxel/synth/noise.h"

namespace roxel {
namespace {

// std::floor is a function call on plain x86-64.
int floor_int(float x) {
  const int truncated = static_cast<int>(x);
  return truncated - (static_cast<float>(truncated) > x);
}

}  // namespace

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

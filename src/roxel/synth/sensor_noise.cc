#include "roxel/synth/sensor_noise.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "roxel/synth/sample_stream.h"

namespace roxel {
namespace {

double normal_number(SampleStream& random) {
  const double radius = std::sqrt(-2 * std::log(1 - static_cast<double>(random.number())));
  return radius * std::cos(2 * std::numbers::pi * random.number());
}

/// Poisson distributed; by multiplied uniform numbers where few photons are expected [Knuth97], else by its
/// normal limit.
double photon_count(double expected, SampleStream& random) {
  if (expected > 50) return std::max(0.0, std::round(expected + std::sqrt(expected) * normal_number(random)));
  const double floor = std::exp(-expected);
  int count = 0;
  for (double product = random.number(); product > floor; product *= random.number()) ++count;
  return count;
}

/// To the nearest step of the bracket that holds the value.
double quantised(double value) {
  const double step = std::exp2(std::max(0.0, std::ceil(std::log2(std::max(value, 1.0))))) / 4096;
  return std::round(value / step) * step;
}

}  // namespace

void add_sensor_noise(Image& rgb, double sigma_at_white, int image, std::uint32_t seed) {
  if (!(sigma_at_white > 0)) return;
  const double photons_at_white = 1 / (sigma_at_white * sigma_at_white);
  for (int y = 0; y < rgb.height(); ++y)
    for (int x = 0; x < rgb.width(); ++x) {
      SampleStream random(x, y, image, seed ^ 0x5e4504u);
      for (int c = 0; c < rgb.channels(); ++c) {
        float& value = rgb.pixel(x, y)[c];
        const double expected = std::max(0.0f, value) * photons_at_white;
        value = static_cast<float>(quantised(photon_count(expected, random) / photons_at_white));
      }
    }
}

}  // namespace roxel

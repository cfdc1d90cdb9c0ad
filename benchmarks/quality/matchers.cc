#include "matchers.h"

#include <algorithm>
#include <iterator>

namespace roxel {

namespace {

constexpr double kExponentialNoises = 2.5;  // the scale of exponential agreement in `roxel reconstruct`
constexpr float kLinearThreshold = 0.8f;    // the thesis does not print its own

}  // namespace

ColorGaussian Matcher::gaussian(const Patch& patch) const {
  WeightedColor sum;
  for (const auto& [share, color] : patch) {
    const float rgb[3] = {static_cast<float>(color.r), static_cast<float>(color.g),
                          static_cast<float>(color.b)};
    WeightedColor part{{}, share};
    transform.from_rgb(rgb, part.color.mean);
    sum = merge(sum, part);
  }
  return sum.color;
}

float Matcher::best(const Patch& patch) const {
  const ColorGaussian mixed = gaussian(patch);
  ColorGaussian plain = mixed;
  std::fill(std::begin(plain.cov), std::end(plain.cov), 0.0f);
  return agree(mixed, plain);
}

Matcher gaussian_matcher(const std::string& name, ColorSpace space, double noises) {
  const float noise = static_cast<float>(noises * default_noise(space));
  return {name, ColorTransform(space), GaussianAgreement(noise)};
}

std::vector<Matcher> matchers(double noises) {
  const ColorSpace stored = ColorSpace::kSrgb;
  const float scale = static_cast<float>(kExponentialNoises * noises * default_noise(stored));
  const float d_max = static_cast<float>(gamut_diameter(stored));
  return {{"linear", ColorTransform(stored), LinearAgreement(d_max, kLinearThreshold)},
          {"exponential", ColorTransform(stored), ExponentialAgreement(scale)},
          gaussian_matcher("sRGB", stored, noises),
          gaussian_matcher("Luv", ColorSpace::kLuv, noises),
          gaussian_matcher("RGB", ColorSpace::kRgb, noises)};
}

}  // namespace roxel

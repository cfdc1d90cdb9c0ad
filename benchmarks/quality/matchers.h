#pragma once
/// The ways of saying how well two patches agree that the figures compare: "sRGB" are values as photographs
/// store them, "RGB" is linear light; every Gaussian space has the noise that `roxel reconstruct` grants it.

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "roxel/color/color_gaussian.h"
#include "roxel/color/color_space.h"

namespace roxel {

/// A patch of a photograph: colours and their shares of its pixels.
using Patch = std::vector<std::pair<float, LinearRgb>>;

/// One way of saying how well two patches agree.
struct Matcher {
  std::string name;
  ColorTransform transform;
  std::function<float(const ColorGaussian&, const ColorGaussian&)> agree;

  /// Mean and covariance of a patch, eq. (4.3), (4.4), in the matcher's space.
  ColorGaussian gaussian(const Patch& patch) const;
  float operator()(const Patch& a, const Patch& b) const { return agree(gaussian(a), gaussian(b)); }
  /// How well the one colour agrees that agrees best: below 1 for mixed patches.
  float best(const Patch& patch) const;
};

/// Gaussian agreement with `noises` times the space's default noise.
Matcher gaussian_matcher(const std::string& name, ColorSpace space, double noises = 1);

/// linear (eq. 4.1, with a threshold), exponential (eq. 4.2), and Gaussian in sRGB, Luv and RGB.
std::vector<Matcher> matchers(double noises = 1);

}  // namespace roxel

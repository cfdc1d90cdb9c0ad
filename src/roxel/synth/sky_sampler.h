#pragma once
/// Random directions that favour the bright parts of a sky.

#include <Eigen/Core>
#include <vector>

#include "roxel/synth/environment.h"

namespace roxel {

class SkySampler {
 public:
  explicit SkySampler(const Environment& environment);

  /// A unit direction for an even pair of numbers in [0, 1).
  Eigen::Vector3f direction(const Eigen::Vector2f& random) const;
  /// Probability a steradian of a unit direction.
  float density(const Eigen::Vector3f& direction) const;
  /// Brightness of the brightest part over the mean: what chance hits of diffuse rays would vary by.
  float peak() const { return peak_; }

 private:
  static constexpr int kColumns = 128, kRows = 64;
  static constexpr float kCellAzimuth = 6.2831853f / kColumns;
  static float row_bottom(int row);  ///< sine of elevation

  std::vector<float> cumulative_;  ///< share of light in the cells up to and with this one
  std::vector<float> density_;
  float peak_ = 1;
};

}  // namespace roxel

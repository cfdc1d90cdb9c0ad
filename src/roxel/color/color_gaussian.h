#pragma once
/// Colour as a normal distribution in the matching space: merging observations and asking how well two agree.
/// Everything here is inline and in floats: it is the body of the march's inner loop.

#include <algorithm>
#include <cmath>

namespace roxel {

/// Mean and covariance of a colour. `cov` is symmetric: xx, yy, zz, xy, xz, yz.
struct ColorGaussian {
  float mean[3] = {0, 0, 0};
  float cov[6] = {0, 0, 0, 0, 0, 0};
};

/// A colour and the summed weight of what it was merged from; weight 0 is the identity of merge().
struct WeightedColor {
  ColorGaussian color;
  float weight = 0;
};

/// The two colours as one [Jethwa04] eq. (4.3), (4.4), with the outer product of the means' difference where
/// the print squares a vector. Weights >= 0; commutative and associative up to rounding.
inline WeightedColor merge(const WeightedColor& a, const WeightedColor& b) {
  WeightedColor out;
  out.weight = a.weight + b.weight;
  if (!(out.weight > 0)) return out;
  const float share_a = a.weight / out.weight;
  const float share_b = b.weight / out.weight;
  float d[3];
  for (int i = 0; i < 3; ++i) {
    d[i] = a.color.mean[i] - b.color.mean[i];
    out.color.mean[i] = share_a * a.color.mean[i] + share_b * b.color.mean[i];
  }
  const float between[6] = {d[0] * d[0], d[1] * d[1], d[2] * d[2], d[0] * d[1], d[0] * d[2], d[1] * d[2]};
  for (int i = 0; i < 6; ++i)
    out.color.cov[i] = share_a * a.color.cov[i] + share_b * b.color.cov[i] + share_a * share_b * between[i];
  return out;
}

/// Agreement of two Gaussians, normalised to (0, 1] [Jethwa04] eq. (4.5):
/// sqrt(|Sigma_min| / |S|) exp(-1/2 d^T S^-1 d), S = Sigma_1 + Sigma_2 + Sigma_min (noise, granted always), d
/// the difference of the means. 1 only for equal means without spread; underflows to 0 for very different
/// colours.
class GaussianAgreement {
 public:
  /// Sigma_min = noise^2 I; noise > 0 in units of the matching space.
  explicit GaussianAgreement(float noise) : variance_(noise * noise) {}

  float noise_variance() const { return variance_; }

  float operator()(const ColorGaussian& a, const ColorGaussian& b) const {
    float cov[6];
    for (int i = 0; i < 6; ++i) cov[i] = a.cov[i] + b.cov[i];
    return of_difference(a.mean[0] - b.mean[0], a.mean[1] - b.mean[1], a.mean[2] - b.mean[2], cov);
  }

  /// The same from the difference of the means and the sum of the covariances (Sigma_min not included).
  /// S = L D L^T: S exceeds Sigma_min = variance I, so in exact arithmetic no pivot is below the variance;
  /// holding them there keeps the result in [0, 1] where rounding would break it (HDR spreads).
  float of_difference(float x, float y, float z, const float cov[6]) const {
    const float d0 = std::max(cov[0] + variance_, variance_);
    const float inv0 = 1 / d0;
    const float l10 = cov[3] * inv0;
    const float l20 = cov[4] * inv0;
    const float d1 = std::max(cov[1] + variance_ - l10 * cov[3], variance_);
    const float inv1 = 1 / d1;
    const float s21 = cov[5] - l10 * cov[4];
    const float l21 = s21 * inv1;
    const float d2 = std::max(cov[2] + variance_ - l20 * cov[4] - l21 * s21, variance_);
    const float inv2 = 1 / d2;
    const float y1 = y - l10 * x;
    const float z2 = z - l20 * x - l21 * y1;
    const float distance2 = x * x * inv0 + y1 * y1 * inv1 + z2 * z2 * inv2;
    const float share = (variance_ * inv0) * (variance_ * inv1) * (variance_ * inv2);
    return std::sqrt(share) * std::exp(-0.5f * distance2);
  }

 private:
  float variance_;
};

/// exp(-d^2 / sigma^2), d the distance of the means (Roxels) [Jethwa04] eq. (4.2); spread is ignored.
class ExponentialAgreement {
 public:
  explicit ExponentialAgreement(float sigma) : inverse_(1 / (sigma * sigma)) {}

  float operator()(const ColorGaussian& a, const ColorGaussian& b) const {
    const float x = a.mean[0] - b.mean[0], y = a.mean[1] - b.mean[1], z = a.mean[2] - b.mean[2];
    return std::exp(-(x * x + y * y + z * z) * inverse_);
  }

 private:
  float inverse_;
};

/// 1 - d / d_max, and 0 where that is below the threshold [Jethwa04] eq. (4.1); spread is ignored.
class LinearAgreement {
 public:
  /// d_max > 0: the largest distance in the space (gamut_diameter); threshold in [0, 1].
  explicit LinearAgreement(float d_max, float threshold = 0) : inverse_(1 / d_max), threshold_(threshold) {}

  float operator()(const ColorGaussian& a, const ColorGaussian& b) const {
    const float x = a.mean[0] - b.mean[0], y = a.mean[1] - b.mean[1], z = a.mean[2] - b.mean[2];
    const float agreement = std::max(0.0f, 1 - std::sqrt(x * x + y * y + z * z) * inverse_);
    return agreement >= threshold_ ? agreement : 0.0f;
  }

 private:
  float inverse_;
  float threshold_;
};

}  // namespace roxel

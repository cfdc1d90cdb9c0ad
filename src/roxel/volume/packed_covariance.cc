#include "roxel/volume/packed_covariance.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace roxel {
namespace {

constexpr float kLargestDeviation = 65504;  ///< of half floats
constexpr float kCorrelationSteps = 32767;
constexpr int kFirst[3] = {0, 0, 1}, kSecond[3] = {1, 2, 2};  // of xy, xz, yz

float from_half(std::uint16_t bits) { return static_cast<float>(Eigen::numext::bit_cast<Eigen::half>(bits)); }

}  // namespace

PackedCovariance::PackedCovariance(const std::array<float, 6>& covariance) {
  for (int c = 0; c < 3; ++c) {
    const float deviation = std::min(std::sqrt(std::max(covariance[c], 0.0f)), kLargestDeviation);
    deviation_[c] = Eigen::numext::bit_cast<std::uint16_t>(Eigen::half(deviation));
  }
  for (int k = 0; k < 3; ++k) {
    // What is kept of the deviations, so that packing once more finds the same.
    const float product = from_half(deviation_[kFirst[k]]) * from_half(deviation_[kSecond[k]]);
    const float correlation = product > 0 ? std::clamp(covariance[3 + k] / product, -1.0f, 1.0f) : 0;
    correlation_[k] = static_cast<std::int16_t>(std::lround(correlation * kCorrelationSteps));
  }
}

std::array<float, 6> PackedCovariance::unpacked() const {
  const std::array<float, 3> d = {from_half(deviation_[0]), from_half(deviation_[1]),
                                  from_half(deviation_[2])};
  std::array<float, 6> covariance;
  for (int c = 0; c < 3; ++c) covariance[c] = d[c] * d[c];
  for (int k = 0; k < 3; ++k)
    covariance[3 + k] =
        static_cast<float>(correlation_[k]) / kCorrelationSteps * (d[kFirst[k]] * d[kSecond[k]]);
  return covariance;
}

}  // namespace roxel

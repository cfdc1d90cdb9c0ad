#pragma once
/// A covariance of three numbers in twelve bytes: deviations as half floats, correlations in steps of
/// 1/32767.

#include <array>
#include <cstdint>

namespace roxel {

/// Variances keep three digits (2^-10 of themselves), and what is packed again stays the same bit for bit.
/// Deviations below 3e-8 are none, those above 65504 are that.
class PackedCovariance {
 public:
  PackedCovariance() = default;
  /// xx, yy, zz, xy, xz, yz; variances below zero count as none, and correlations beyond 1 as that.
  explicit PackedCovariance(const std::array<float, 6>& covariance);

  /// In the same order.
  std::array<float, 6> unpacked() const;

  bool operator==(const PackedCovariance&) const = default;

 private:
  std::array<std::uint16_t, 3> deviation_ = {0, 0, 0};   ///< of x, y, z: the half float's bits
  std::array<std::int16_t, 3> correlation_ = {0, 0, 0};  ///< of xy, xz, yz
};
static_assert(sizeof(PackedCovariance) == 12);

}  // namespace roxel

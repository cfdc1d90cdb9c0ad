#pragma once
/// Whether opacities are honest: of the pixels whose ray is said to end in the box with probability p, a
/// share p should truly do so. [Niculescu05] draws it as a reliability curve.

#include <array>
#include <cstdint>
#include <span>

namespace roxel {

/// Pixels by the opacity of their rays; add() joins views.
struct Reliability {
  static constexpr int kBins = 20;
  std::array<std::int64_t, kBins> pixels{};  ///< [0, 0.05), ..., [0.95, 1]
  std::array<double, kBins> opacity_sum{};
  std::array<std::int64_t, kBins> with_surface{};  ///< those whose ray truly meets a surface in the box

  void add(double opacity, bool surface);
  void add(const Reliability& other);
  std::int64_t total() const;
  double mean_opacity(int bin) const;  ///< 0 without pixels, as the next
  double surface_share(int bin) const;
  /// Mean over pixels of |mean opacity - share with surface| of their bin, in [0, 1] [Naeini15].
  double expected_calibration_error() const;
};

/// `truth`: depth of the surface in the box, 0 = none; NaN leaves a pixel out. Sizes must be equal.
Reliability reliability(std::span<const float> opacity, std::span<const float> truth);

}  // namespace roxel

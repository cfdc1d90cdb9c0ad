#include "roxel/eval/reliability.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "roxel/base/error.h"

namespace roxel {

void Reliability::add(double opacity, bool surface) {
  const int bin = std::clamp(static_cast<int>(opacity * kBins), 0, kBins - 1);
  ++pixels[bin];
  opacity_sum[bin] += opacity;
  with_surface[bin] += surface;
}

void Reliability::add(const Reliability& other) {
  for (int bin = 0; bin < kBins; ++bin) {
    pixels[bin] += other.pixels[bin];
    opacity_sum[bin] += other.opacity_sum[bin];
    with_surface[bin] += other.with_surface[bin];
  }
}

std::int64_t Reliability::total() const {
  return std::accumulate(pixels.begin(), pixels.end(), std::int64_t{0});
}

double Reliability::mean_opacity(int bin) const {
  return pixels[bin] > 0 ? opacity_sum[bin] / static_cast<double>(pixels[bin]) : 0.0;
}

double Reliability::surface_share(int bin) const {
  return pixels[bin] > 0 ? static_cast<double>(with_surface[bin]) / static_cast<double>(pixels[bin]) : 0.0;
}

double Reliability::expected_calibration_error() const {
  double sum = 0;
  for (int bin = 0; bin < kBins; ++bin)
    sum += std::abs(opacity_sum[bin] - static_cast<double>(with_surface[bin]));
  return total() > 0 ? sum / static_cast<double>(total()) : 0.0;
}

Reliability reliability(std::span<const float> opacity, std::span<const float> truth) {
  ROXEL_CHECK_EQ(opacity.size(), truth.size());
  Reliability sums;
  for (std::size_t i = 0; i < truth.size(); ++i)
    if (truth[i] >= 0 && std::isfinite(opacity[i])) sums.add(opacity[i], truth[i] > 0);
  return sums;
}

}  // namespace roxel

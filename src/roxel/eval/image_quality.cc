#include "roxel/eval/image_quality.h"

#include <cmath>
#include <limits>

#include "roxel/base/error.h"

namespace roxel {
namespace {

constexpr int kRadius = 5;
constexpr double kDeviation = 1.5;
constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;

std::array<double, 2 * kRadius + 1> window_weights() {
  std::array<double, 2 * kRadius + 1> weights;
  double sum = 0;
  for (int i = -kRadius; i <= kRadius; ++i)
    sum += weights[i + kRadius] = std::exp(-0.5 * i * i / (kDeviation * kDeviation));
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// Row-major plane of doubles.
struct Plane {
  Plane(int w, int h) : width(w), height(h), values(static_cast<std::size_t>(w) * h) {}
  double& at(int x, int y) { return values[static_cast<std::size_t>(y) * width + x]; }
  double at(int x, int y) const { return values[static_cast<std::size_t>(y) * width + x]; }
  int width, height;
  std::vector<double> values;
};

/// Weighted mean of the window about each pixel that has a whole one; the border is left at 0.
Plane blurred(const Plane& plane) {
  static const auto weights = window_weights();
  Plane rows(plane.width, plane.height), both(plane.width, plane.height);
  for (int y = 0; y < plane.height; ++y)
    for (int x = kRadius; x < plane.width - kRadius; ++x)
      for (int i = -kRadius; i <= kRadius; ++i) rows.at(x, y) += weights[i + kRadius] * plane.at(x + i, y);
  for (int y = kRadius; y < plane.height - kRadius; ++y)
    for (int x = kRadius; x < plane.width - kRadius; ++x)
      for (int i = -kRadius; i <= kRadius; ++i) both.at(x, y) += weights[i + kRadius] * rows.at(x, y + i);
  return both;
}

struct Moments {
  Plane a, b, aa, bb, ab;
};

Moments moments(const Image& render, const Image& photo, int channel) {
  const int width = photo.width(), height = photo.height();
  Moments m{{width, height}, {width, height}, {width, height}, {width, height}, {width, height}};
  for (std::size_t i = 0; i < m.a.values.size(); ++i) {
    const double a = render.data()[3 * i + channel], b = photo.data()[3 * i + channel];
    m.a.values[i] = a;
    m.b.values[i] = b;
    m.aa.values[i] = a * a;
    m.bb.values[i] = b * b;
    m.ab.values[i] = a * b;
  }
  return {blurred(m.a), blurred(m.b), blurred(m.aa), blurred(m.bb), blurred(m.ab)};
}

double similarity(const Moments& m, std::size_t i) {
  const double mean_a = m.a.values[i], mean_b = m.b.values[i];
  const double var_a = m.aa.values[i] - mean_a * mean_a, var_b = m.bb.values[i] - mean_b * mean_b,
               covariance = m.ab.values[i] - mean_a * mean_b;
  return (2 * mean_a * mean_b + kC1) * (2 * covariance + kC2) /
         ((mean_a * mean_a + mean_b * mean_b + kC1) * (var_a + var_b + kC2));
}

void check(const Image& render, const Image& photo, const Mask& counted) {
  ROXEL_CHECK_EQ(render.channels(), 3);
  ROXEL_CHECK_EQ(photo.channels(), 3);
  ROXEL_CHECK_EQ(render.width(), photo.width());
  ROXEL_CHECK_EQ(render.height(), photo.height());
  if (counted.empty()) return;
  ROXEL_CHECK_EQ(counted.width(), photo.width());
  ROXEL_CHECK_EQ(counted.height(), photo.height());
}

double mean(double sum, double count) { return count > 0 ? sum / count : 0.0; }
double total(const std::array<double, 3>& sums) { return sums[0] + sums[1] + sums[2]; }
double decibels(double rms) {
  return rms > 0 ? -20 * std::log10(rms) : std::numeric_limits<double>::infinity();
}

}  // namespace

double ImageQuality::rms(int channel) const {
  return std::sqrt(mean(squared_sum[channel], static_cast<double>(pixels)));
}
double ImageQuality::rms() const {
  return std::sqrt(mean(total(squared_sum), 3.0 * static_cast<double>(pixels)));
}
double ImageQuality::psnr(int channel) const { return decibels(rms(channel)); }
double ImageQuality::psnr() const { return decibels(rms()); }
double ImageQuality::ssim(int channel) const { return mean(ssim_sum[channel], static_cast<double>(windows)); }
double ImageQuality::ssim() const { return mean(total(ssim_sum), 3.0 * static_cast<double>(windows)); }

void ImageQuality::add(const ImageQuality& other) {
  pixels += other.pixels;
  windows += other.windows;
  for (int c = 0; c < 3; ++c) {
    squared_sum[c] += other.squared_sum[c];
    ssim_sum[c] += other.ssim_sum[c];
  }
}

ImageQuality image_quality(const Image& render, const Image& photo, const Mask& counted) {
  check(render, photo, counted);
  ImageQuality sums;
  const int width = photo.width(), height = photo.height();
  const auto counts = [&](int x, int y) { return counted.empty() || counted.at(x, y) >= 128; };
  const auto whole = [&](int x, int y) {
    return x >= kRadius && x < width - kRadius && y >= kRadius && y < height - kRadius;
  };
  for (int c = 0; c < 3; ++c) {
    const Moments window = moments(render, photo, c);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (!counts(x, y)) continue;
        const double difference = static_cast<double>(render.pixel(x, y)[c]) - photo.pixel(x, y)[c];
        sums.squared_sum[c] += difference * difference;
        sums.pixels += c == 0;
        if (!whole(x, y)) continue;
        sums.ssim_sum[c] += similarity(window, static_cast<std::size_t>(y) * width + x);
        sums.windows += c == 0;
      }
  }
  return sums;
}

}  // namespace roxel

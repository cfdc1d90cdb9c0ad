#include "roxel/depth/patch_match.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "roxel/base/kernel.h"
#include "roxel/base/lanes.h"

namespace roxel {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kLikePatchColor = 0.12f;  ///< difference of colours at which a sample counts e^-1/2

constexpr float kLeastWeight = 0.01f;  ///< samples that count less are left out

using Steps = Patch::Steps;

Steps steps_of(const PatchWarp& warp, const PixelPlane& plane, double u, double v) {
  const Eigen::Vector3d at = warp.from_pixel * Eigen::Vector3d(u, v, 1) + plane.w * warp.parallax;
  const Eigen::Vector3d du = warp.from_pixel.col(0) + plane.wu * warp.parallax;
  const Eigen::Vector3d dv = warp.from_pixel.col(1) + plane.wv * warp.parallax;
  return {static_cast<float>(at.x()), static_cast<float>(du.x()), static_cast<float>(dv.x()),
          static_cast<float>(at.y()), static_cast<float>(du.y()), static_cast<float>(dv.y()),
          static_cast<float>(at.z()), static_cast<float>(du.z()), static_cast<float>(dv.z())};
}

struct Sums {
  float v, vv, rv;
};

/// Weighted sums over the samples, which must all lie inside the image; values are interpolated linearly.
ROXEL_KERNEL Sums sum_samples(const float* luma, int width, const Steps& s, const float* du, const float* dv,
                              const float* weight, const float* value, int count) {
  Floats v{}, vv{}, rv{};
  for (int i = 0; i < count; i += kLanes) {
    Floats u_i, v_i, w_i, r_i;
    load(du + i, u_i);
    load(dv + i, v_i);
    load(weight + i, w_i);
    load(value + i, r_i);
    const Floats z = 1 / (s.z0 + s.zu * u_i + s.zv * v_i);
    const Floats x = (s.x0 + s.xu * u_i + s.xv * v_i) * z - 0.5f;
    const Floats y = (s.y0 + s.yu * u_i + s.yv * v_i) * z - 0.5f;
    const Ints ix = __builtin_convertvector(x, Ints), iy = __builtin_convertvector(y, Ints);
    const Floats fx = x - __builtin_convertvector(ix, Floats), fy = y - __builtin_convertvector(iy, Floats);
    const Ints at = iy * width + ix;
    std::int32_t offset[kLanes];
    store(at, offset);
    Floats a, b, c, d;
    load_pairs(luma, offset, a, b);
    load_pairs(luma + width, offset, c, d);
    const Floats top = a + fx * (b - a), bottom = c + fx * (d - c);
    const Floats sample = top + fy * (bottom - top);
    const Floats weighted = w_i * sample;
    v += weighted;
    vv += weighted * sample;
    rv += weighted * r_i;
  }
  Sums sums{0, 0, 0};
  for (int k = 0; k < kLanes; ++k) sums.v += v[k], sums.vv += vv[k], sums.rv += rv[k];
  return sums;
}

/// Catmull-Rom weights of four samples for positions t in [0, 1) between the middle two, and their
/// derivatives.
struct Cubic {
  Floats w[4], d[4];
  inline __attribute__((always_inline)) explicit Cubic(const Floats& t) {
    const Floats t2 = t * t, t3 = t2 * t;
    w[0] = 0.5f * (-t + 2 * t2 - t3);
    w[1] = 0.5f * (2 - 5 * t2 + 3 * t3);
    w[2] = 0.5f * (t + 4 * t2 - 3 * t3);
    w[3] = 0.5f * (-t2 + t3);
    d[0] = 0.5f * (-1 + 4 * t - 3 * t2);
    d[1] = 0.5f * (-10 * t + 9 * t2);
    d[2] = 0.5f * (1 + 8 * t - 9 * t2);
    d[3] = 0.5f * (-2 * t + 3 * t2);
  }
};

/// Where patches are sampled for least squares, and what comes of it.
struct CubicSamples {
  const float *du, *dv, *weight;
  int count;
  float parallax[3];
  float *value, *slope;  ///< of each sample, and its change with the inverse depth
};

/// Values are interpolated by cubics: linear interpolation would pull depths to where samples fall on pixels.
ROXEL_KERNEL float sample_cubic(const float* luma, int width, const Steps& s, const CubicSamples& out) {
  Floats mean{};
  for (int i = 0; i < out.count; i += kLanes) {
    Floats u_i, v_i, w_i;
    load(out.du + i, u_i);
    load(out.dv + i, v_i);
    load(out.weight + i, w_i);
    const Floats z = 1 / (s.z0 + s.zu * u_i + s.zv * v_i);
    const Floats hx = (s.x0 + s.xu * u_i + s.xv * v_i) * z, hy = (s.y0 + s.yu * u_i + s.yv * v_i) * z;
    const Floats x = hx - 0.5f, y = hy - 0.5f;
    const Ints ix = __builtin_convertvector(x, Ints), iy = __builtin_convertvector(y, Ints);
    const Cubic cx(x - __builtin_convertvector(ix, Floats)), cy(y - __builtin_convertvector(iy, Floats));
    std::int32_t offset[kLanes];
    store((iy - 1) * width + ix - 1, offset);
    Floats value{}, gx{}, gy{};
    for (int j = 0; j < 4; ++j) {
      FourFloats taps[kLanes];
#pragma GCC unroll 8
      for (int k = 0; k < kLanes; ++k) load(luma + j * width + offset[k], taps[k]);
      Floats columns[4];
      transpose(taps, columns);
      Floats row{}, slope{};
      for (int c = 0; c < 4; ++c) {
        row += cx.w[c] * columns[c];
        slope += cx.d[c] * columns[c];
      }
      value += cy.w[j] * row;
      gx += cy.w[j] * slope;
      gy += cy.d[j] * row;
    }
    store(value, out.value + i);
    store((gx * (out.parallax[0] - hx * out.parallax[2]) + gy * (out.parallax[1] - hy * out.parallax[2])) * z,
          out.slope + i);
    mean += w_i * value;
  }
  float sum = 0;
  for (int k = 0; k < kLanes; ++k) sum += mean[k];
  return sum;
}

/// Weighted sums over the samples: c = value - mean, r the reference's value, g the slope.
struct Moments {
  float cc, cr, rr;
  float g[3], gc[3], gr[3];  ///< times 1, du, dv
  float gg[6];               ///< times 1, du, dv, du du, du dv, dv dv
};

ROXEL_KERNEL Moments moments_of(const CubicSamples& in, const float* reference, float mean) {
  Floats sum[18]{};
  for (int i = 0; i < in.count; i += kLanes) {
    Floats u, v, w, value, slope, r;
    load(in.du + i, u);
    load(in.dv + i, v);
    load(in.weight + i, w);
    load(in.value + i, value);
    load(in.slope + i, slope);
    load(reference + i, r);
    const Floats c = value - mean, wg = w * slope, wgg = wg * slope, wc = w * c;
    sum[0] += wc * c, sum[1] += wc * r, sum[2] += w * r * r;
    sum[3] += wg, sum[4] += wg * u, sum[5] += wg * v;
    sum[6] += wg * c, sum[7] += wg * c * u, sum[8] += wg * c * v;
    sum[9] += wg * r, sum[10] += wg * r * u, sum[11] += wg * r * v;
    sum[12] += wgg, sum[13] += wgg * u, sum[14] += wgg * v;
    sum[15] += wgg * u * u, sum[16] += wgg * u * v, sum[17] += wgg * v * v;
  }
  float total[18];
  for (int k = 0; k < 18; ++k) {
    total[k] = 0;
    for (int lane = 0; lane < kLanes; ++lane) total[k] += sum[k][lane];
  }
  Moments m{total[0], total[1], total[2], {}, {}, {}, {}};
  for (int k = 0; k < 3; ++k) m.g[k] = total[3 + k], m.gc[k] = total[6 + k], m.gr[k] = total[9 + k];
  for (int k = 0; k < 6; ++k) m.gg[k] = total[12 + k];
  return m;
}

/// Square of how far two pixels' colours are apart.
float unlikeness(const Image& luma, const Image& color, int x, int y, int nx, int ny) {
  const Image& image = color.empty() ? luma : color;
  const float *a = image.pixel(x, y), *b = image.pixel(nx, ny);
  float sum = 0;
  for (int c = 0; c < image.channels(); ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

/// Steps look alike in light and shade.
float perceived(double light) { return static_cast<float>(std::cbrt(std::max(0.0, light) + 1e-3) - 0.1); }

}  // namespace

Image matching_color(const Image& rgb, double white) {
  Image color(rgb.width(), rgb.height(), 3);
  for (std::size_t i = 0; i < color.data().size(); ++i) color.data()[i] = perceived(rgb.data()[i] / white);
  return color;
}

Image matching_luma(const Image& rgb, double white, const Mask& valid) {
  Image luma(rgb.width(), rgb.height(), 1);
  for (std::size_t i = 0; i < luma.data().size(); ++i) {
    const float* p = rgb.data().data() + 3 * i;
    const double y = (0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]) / white;
    luma.data()[i] = perceived(y);
    if (!valid.empty() && valid.data()[i] == 0) luma.data()[i] = kNaN;
  }
  return luma;
}

PatchWarp::PatchWarp(const PinholeCamera& reference, const PinholeCamera& source) {
  const Eigen::Matrix3d k = source.intrinsics.matrix();
  from_pixel = k * source.pose.rotation * reference.pose.rotation.transpose() *
               reference.intrinsics.matrix().inverse();
  parallax = k * source.pose.rotation * (reference.pose.centre - source.pose.centre);
}

Patch::Patch(const Image& luma, const Image& color, const PlaneMap& surface, int x, int y,
             const PatchOptions& options)
    : u_(x), v_(y), radius_(options.radius), noise_variance_(options.noise * options.noise) {
  const float middle = *luma.pixel(x, y);
  if (!std::isfinite(middle)) return;
  const PixelPlane& own = surface.at(x, y);
  const float gap = static_cast<float>(options.gap) * own.w * own.w;
  const float spread = 0.5f / static_cast<float>(radius_ * radius_);
  double sum = 0, squares = 0, mean = 0;
  for (int dy = -radius_; dy <= radius_; ++dy)
    for (int dx = -radius_; dx <= radius_; ++dx) {
      if (x + dx < 0 || y + dy < 0 || x + dx >= luma.width() || y + dy >= luma.height()) continue;
      const float value = *luma.pixel(x + dx, y + dy);
      if (!std::isfinite(value)) continue;
      const PixelPlane& other = surface.at(x + dx, y + dy);
      const float expected = own.at(static_cast<float>(dx), static_cast<float>(dy));
      if (other.empty() || std::abs(other.w - expected) > gap) continue;
      const float off = unlikeness(luma, color, x, y, x + dx, y + dy) / (kLikePatchColor * kLikePatchColor);
      const float weight = std::exp(-0.5f * off - spread * static_cast<float>(dx * dx + dy * dy));
      if (weight < kLeastWeight) continue;
      du_[count_] = static_cast<float>(dx);
      dv_[count_] = static_cast<float>(dy);
      weight_[count_] = weight;
      value_[count_] = value;
      ++count_;
      sum += weight;
      squares += static_cast<double>(weight) * weight;
      mean += static_cast<double>(weight) * value;
    }
  if (!(sum > 0)) return;
  mean /= sum;
  for (int i = 0; i < count_; ++i) {
    weight_[i] = static_cast<float>(weight_[i] / sum);
    value_[i] -= static_cast<float>(mean);
    variance_ += static_cast<double>(weight_[i]) * value_[i] * value_[i];
  }
  while (count_ % 8 != 0) du_[count_] = dv_[count_] = weight_[count_] = value_[count_] = 0, ++count_;
  sample_count_ = sum * sum / squares;
  usable_ = sample_count_ >= 6;
}

bool Patch::place(const PatchSource& source, const PixelPlane& plane, Steps& s) const {
  s = steps_of(source.warp, plane, u_ + 0.5, v_ + 0.5);
  const float r = static_cast<float>(radius_);
  const float right = static_cast<float>(source.luma->width()) - 2.5f;
  const float below = static_cast<float>(source.luma->height()) - 2.5f;
  const FourFloats du = {-r, r, -r, r}, dv = {-r, -r, r, r};  // of the corners
  const FourFloats z = s.z0 + s.zu * du + s.zv * dv, w = plane.w + plane.wu * du + plane.wv * dv;
  const FourFloats x = (s.x0 + s.xu * du + s.xv * dv) / z - 0.5f;
  const FourFloats y = (s.y0 + s.yu * du + s.yv * dv) / z - 0.5f;
  const auto inside = (z > 0) & (w > 0) & (x >= 1.5f) & (y >= 1.5f) & (x < right) & (y < below);
  return (inside[0] & inside[1] & inside[2] & inside[3]) != 0;
}

float Patch::correlation(const PatchSource& source, const PixelPlane& plane) const {
  Steps s;
  return place(source, plane, s) ? correlation(source, s) : kNaN;
}

float Patch::correlation(const PatchSource& source, const Steps& s) const {
  const Sums sums = sum_samples(source.luma->data().data(), source.luma->width(), s, du_.data(), dv_.data(),
                                weight_.data(), value_.data(), count_);
  const double variance = std::max(0.0, static_cast<double>(sums.vv) - static_cast<double>(sums.v) * sums.v);
  return sums.rv /
         std::sqrt(static_cast<float>((variance + noise_variance_) * (variance_ + noise_variance_)));
}

Patch::Equations Patch::linearise(const PatchSource& source, const PixelPlane& plane) const {
  Equations out;
  Steps s;
  if (!place(source, plane, s)) return out;
  const Eigen::Vector3d& parallax = source.warp.parallax;
  alignas(32) std::array<float, kMostSamples> value, slope;
  const CubicSamples samples{
      du_.data(),
      dv_.data(),
      weight_.data(),
      count_,
      {static_cast<float>(parallax.x()), static_cast<float>(parallax.y()), static_cast<float>(parallax.z())},
      value.data(),
      slope.data()};
  const float mean = sample_cubic(source.luma->data().data(), source.luma->width(), s, samples);
  if (!std::isfinite(mean)) return out;
  const Moments m = moments_of(samples, value_.data(), mean);
  out.gain = m.cr / (m.cc + noise_variance_);
  if (!(out.gain > 0)) return out;
  // J = gain x slope x (1, du, dv); the residual is r - gain c. Light's gain and offset are solved for: what
  // J has of them is taken out.
  const double g = out.gain, inverse = 1 / (m.cc + noise_variance_);
  const double residual_c = m.cr - g * m.cc;
  out.residual = std::max(0.0, m.rr - 2 * g * m.cr + g * g * m.cc);
  static constexpr int kRow[6] = {0, 0, 0, 1, 1, 2}, kColumn[6] = {0, 1, 2, 1, 2, 2};
  for (int k = 0; k < 6; ++k)
    out.a[k] = g * g *
               (m.gg[k] - static_cast<double>(m.g[kRow[k]]) * m.g[kColumn[k]] -
                inverse * m.gc[kRow[k]] * m.gc[kColumn[k]]);
  for (int k = 0; k < 3; ++k) out.b[k] = g * (m.gr[k] - g * m.gc[k] - inverse * m.gc[k] * residual_c);
  out.valid = true;
  return out;
}

}  // namespace roxel

#include "roxel/image/sample_pyramid.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/error.h"

namespace roxel {
namespace {

constexpr int kRow[6] = {0, 1, 2, 0, 0, 1};
constexpr int kColumn[6] = {0, 1, 2, 1, 2, 2};

/// Moments of a region. While no object pixel was met, mean and cov are over valid weight, then over object
/// weight alone: a region's children settle which, so one set of moments is enough.
struct Moments {
  double valid = 0;   // summed weight, in pixels
  double object = 0;  // summed weight of object, <= valid
  double mean[3] = {0, 0, 0};
  double cov[6] = {0, 0, 0, 0, 0, 0};

  double weight() const { return object > 0 ? object : valid; }

  // Parallel-axis theorem: the covariance of a union is the mean covariance plus the spread of the means.
  void blend(const Moments& other) {
    const double total = weight() + other.weight();
    const double share = other.weight() / total;
    double d[3];
    for (int i = 0; i < 3; ++i) {
      d[i] = other.mean[i] - mean[i];
      mean[i] += share * d[i];
    }
    for (int i = 0; i < 6; ++i)
      cov[i] += share * (other.cov[i] - cov[i]) + share * (1 - share) * d[kRow[i]] * d[kColumn[i]];
  }

  void add(const Moments& other) {
    if (!(other.valid > 0)) return;
    const bool has_object = object > 0, other_has_object = other.object > 0;
    if (!(valid > 0) || (other_has_object && !has_object)) {
      std::copy(other.mean, other.mean + 3, mean);
      std::copy(other.cov, other.cov + 6, cov);
    } else if (other_has_object == has_object) {
      blend(other);
    }
    valid += other.valid;
    object += other.object;
  }

  RegionStats stats(int level) const {
    RegionStats out{};
    if (!(valid > 0)) return out;
    for (int i = 0; i < 3; ++i) out.mean[i] = static_cast<float>(mean[i]);
    for (int i = 0; i < 6; ++i) out.cov[i] = static_cast<float>(cov[i]);
    out.valid = static_cast<float>(std::ldexp(valid, -2 * level));
    out.foreground = static_cast<float>(object / valid);
    return out;
  }
};

int divided_up(int size, int level) {
  const std::int64_t side = std::int64_t{1} << level;
  return static_cast<int>((size + side - 1) / side);
}

}  // namespace

/// Depth-first over the regions: every pixel is read once, and no level below the finest one takes memory.
struct SamplePyramid::Builder {
  const Image& samples;
  const Mask& valid;
  const Mask& foreground;
  SamplePyramid& pyramid;

  Moments leaf(int x, int y) const {
    Moments out;
    out.valid = valid.empty() ? 1.0 : valid.at(x, y) / 255.0;
    out.object = foreground.empty() ? out.valid : out.valid * (foreground.at(x, y) / 255.0);
    const float* pixel = samples.pixel(x, y);
    for (int i = 0; i < 3; ++i) out.mean[i] = pixel[i];
    return out;
  }

  Moments region(int level, int x, int y) const {
    if (level == 0) return leaf(x, y);
    Moments out;
    const int right = std::min(2 * x + 2, divided_up(samples.width(), level - 1));
    const int bottom = std::min(2 * y + 2, divided_up(samples.height(), level - 1));
    for (int j = 2 * y; j < bottom; ++j)
      for (int i = 2 * x; i < right; ++i) out.add(region(level - 1, i, j));
    if (level >= pyramid.finest_level_) {
      Level& stored = pyramid.levels_[level - pyramid.finest_level_];
      stored.regions[static_cast<std::size_t>(y) * stored.width + x] = out.stats(level);
    }
    return out;
  }
};

SamplePyramid::SamplePyramid(const Image& samples, const Mask& valid, const Mask& foreground,
                             int finest_level, int coarsest_level)
    : finest_level_(finest_level), masked_(!foreground.empty()) {
  ROXEL_CHECK_EQ(samples.channels(), 3);
  ROXEL_CHECK_GE(finest_level, 0);
  ROXEL_CHECK_LE(finest_level, coarsest_level);
  ROXEL_CHECK_LE(coarsest_level, 30);
  for (const Mask* mask : {&valid, &foreground}) {
    if (mask->empty()) continue;
    ROXEL_CHECK_EQ(mask->width(), samples.width());
    ROXEL_CHECK_EQ(mask->height(), samples.height());
  }

  for (int level = finest_level; level <= coarsest_level; ++level) {
    Level stored{divided_up(samples.width(), level), divided_up(samples.height(), level), {}};
    if (level > 0) stored.regions.resize(static_cast<std::size_t>(stored.width) * stored.height);
    levels_.push_back(std::move(stored));
  }
  if (finest_level == 0) {
    pixels_ = samples.data();
    valid_ = valid.data();
    foreground_ = foreground.data();
    for (std::size_t i = 0; i < valid_.size(); ++i) {
      if (valid_[i] > 0) continue;
      std::fill_n(pixels_.begin() + 3 * i, 3, 0.0f);
      if (foreground_.empty()) foreground_.assign(valid_.size(), 255);
      foreground_[i] = 0;
    }
  }

  const Builder builder{samples, valid, foreground, *this};
  for (int y = 0; coarsest_level > 0 && y < height(coarsest_level); ++y)
    for (int x = 0; x < width(coarsest_level); ++x) builder.region(coarsest_level, x, y);
}

bool SamplePyramid::bilinear(int level, double u, double v, float mean[3]) const {
  const int columns = width(level), rows = height(level);
  const auto column = [columns](double x) {
    return std::clamp(static_cast<int>(std::floor(x)), 0, columns - 1);
  };
  const auto row = [rows](double y) { return std::clamp(static_cast<int>(std::floor(y)), 0, rows - 1); };
  const double x = std::ldexp(u, -level), y = std::ldexp(v, -level);
  const bool object_only = at(level, column(x), row(y)).foreground > 0;

  // Region centres lie at i + 1/2.
  const double left = std::floor(x - 0.5), top = std::floor(y - 0.5);
  const double right_share = x - 0.5 - left, bottom_share = y - 0.5 - top;
  double sum[3] = {0, 0, 0}, total = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const int i = corner & 1, j = corner >> 1;
    const RegionStats region = at(level, column(left + i), row(top + j));
    const double weight = (i ? right_share : 1 - right_share) * (j ? bottom_share : 1 - bottom_share) *
                          region.valid * (object_only ? region.foreground : 1.0);
    for (int c = 0; c < 3; ++c) sum[c] += weight * region.mean[c];
    total += weight;
  }
  for (int c = 0; c < 3; ++c) mean[c] = total > 0 ? static_cast<float>(sum[c] / total) : 0.0f;
  return total > 0;
}

std::size_t SamplePyramid::bytes() const {
  std::size_t sum = sizeof(*this) + levels_.capacity() * sizeof(Level);
  for (const Level& level : levels_) sum += level.regions.capacity() * sizeof(RegionStats);
  return sum + pixels_.capacity() * sizeof(float) + valid_.capacity() + foreground_.capacity();
}

}  // namespace roxel

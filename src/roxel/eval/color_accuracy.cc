#include "roxel/eval/color_accuracy.h"

#include <cmath>
#include <numeric>

#include "roxel/color/delta_e.h"
#include "roxel/eval/surface_accuracy.h"

namespace roxel {
namespace {

double dot(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) sum += static_cast<double>(a[c]) * b[c];
  return sum;
}

/// The s that makes the sum of (s e - t)^2 least.
double best_scale(const std::vector<ColorPair>& pairs) {
  double with_truth = 0, with_itself = 0;
  for (const ColorPair& pair : pairs) {
    with_truth += dot(pair.estimate, pair.truth);
    with_itself += dot(pair.estimate, pair.estimate);
  }
  return with_itself > 0 ? with_truth / with_itself : 1.0;
}

double relative_error(const ColorPair& pair, double scale) {
  double squared = 0;
  for (int c = 0; c < 3; ++c) squared += std::pow(scale * pair.estimate[c] - pair.truth[c], 2);
  return std::sqrt(squared / dot(pair.truth, pair.truth));
}

Lab lab_of(const std::array<float, 3>& rgb, double scale) {
  return lab_from_xyz(xyz_from_rgb({scale * rgb[0], scale * rgb[1], scale * rgb[2]}));
}

double mean(const std::vector<double>& values) {
  return values.empty()
             ? 0.0
             : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

std::optional<ColorPair> color_pair(const float* over_black, float opacity, const float* truth) {
  ColorPair pair;
  bool finite = opacity > 0;
  for (int c = 0; c < 3; ++c) {
    pair.estimate[c] = over_black[c] / opacity;
    pair.truth[c] = truth[c];
    finite = finite && std::isfinite(pair.estimate[c]) && std::isfinite(pair.truth[c]);
  }
  return finite ? std::optional(pair) : std::nullopt;
}

ColorAccuracy color_accuracy(std::vector<ColorPair> pairs) {
  std::erase_if(pairs, [](const ColorPair& pair) { return !(dot(pair.truth, pair.truth) > 0); });
  ColorAccuracy accuracy;
  accuracy.scale = best_scale(pairs);
  std::vector<double> differences, relative;
  for (const ColorPair& pair : pairs) {
    differences.push_back(delta_e_2000(lab_of(pair.estimate, accuracy.scale), lab_of(pair.truth, 1)));
    relative.push_back(relative_error(pair, accuracy.scale));
  }
  accuracy.pixels = static_cast<std::int64_t>(relative.size());
  accuracy.mean_delta_e = mean(differences);
  accuracy.mean_relative = mean(relative);
  accuracy.median_delta_e = quantile(differences, 0.5);
  accuracy.delta_e_90 = quantile(differences, 0.9);
  accuracy.median_relative = quantile(relative, 0.5);
  return accuracy;
}

}  // namespace roxel

#include "roxel/solve/gains.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "roxel/base/parallel.h"
#include "roxel/march/render.h"
#include "roxel/solve/run_stages.h"

namespace roxel {

namespace {

constexpr int kSide = 96;              ///< pixels along the longer side at which views are compared
constexpr float kCovered = 0.7f;       ///< opacity of a pixel that shows the volume
constexpr float kDarkestPair = 0.01f;  ///< canonical; below, noise and black level decide the ratio
constexpr float kBrightest = 0.98f;    ///< of a display image's full scale: clipped
constexpr std::size_t kFewestPixels = 32;
constexpr double kHuber = 1.345;  ///< standard deviations: 95 % efficiency on Gaussian errors

/// Robust mean: Huber's, by reweighting, with the median absolute deviation as scale.
double huber_mean(std::vector<double> values) {
  const auto median = [](std::vector<double>& of) {
    const auto middle = of.begin() + static_cast<std::ptrdiff_t>(of.size() / 2);
    std::nth_element(of.begin(), middle, of.end());
    return *middle;
  };
  double mean = median(values);
  std::vector<double> deviations(values.size());
  std::transform(values.begin(), values.end(), deviations.begin(),
                 [mean](double value) { return std::abs(value - mean); });
  const double limit = kHuber * std::max(1e-6, 1.4826 * median(deviations));
  for (int round = 0; round < 10; ++round) {
    double sum = 0, weights = 0;
    for (const double value : values) {
      const double weight = std::min(1.0, limit / std::max(1e-12, std::abs(value - mean)));
      sum += weight * value, weights += weight;
    }
    mean = sum / weights;
  }
  return mean;
}

PinholeCamera shrunk(const PinholeCamera& camera, int factor) {
  PinholeCamera small = camera;
  Intrinsics& k = small.intrinsics;
  k.width = std::max(1, k.width / factor), k.height = std::max(1, k.height / factor);
  k.fx /= factor, k.fy /= factor, k.cx /= factor, k.cy /= factor, k.skew /= factor;
  return small;
}

/// Mean of the square's pixels, per channel; false where one of them is unusable, background or clipped.
bool square_mean(const Photograph& photo, float clipped, int side, int x, int y, float* mean) {
  std::array<double, 3> sum{0, 0, 0};
  for (int v = y * side; v < (y + 1) * side; ++v)
    for (int u = x * side; u < (x + 1) * side; ++u) {
      if (!photo.valid.empty() && photo.valid.at(u, v) < 255) return false;
      if (!photo.foreground.empty() && photo.foreground.at(u, v) < 255) return false;
      const float* pixel = photo.rgb.pixel(u, v);
      for (int c = 0; c < 3; ++c) {
        if (pixel[c] >= clipped) return false;
        sum[c] += pixel[c];
      }
    }
  for (int c = 0; c < 3; ++c) mean[c] = static_cast<float>(sum[c] / (side * side));
  return true;
}

/// One view's, or nothing where it shows too little.
std::optional<std::array<double, 3>> fit_view(const LatticeStack& stack,
                                              const std::vector<std::array<float, 3>>& colors,
                                              const Dataset& dataset, int view_idx,
                                              const PhotographSquares& photo, const Scene& scene) {
  RenderOptions box_alone;
  box_alone.surround = false;
  const Rendering rendering = render(stack, colors, shrunk(dataset.views[view_idx].camera, photo.side),
                                     view_range(scene, dataset, view_idx), box_alone, RunContext(1));
  return log_gain(photo, rendering, scene.exposure);
}

/// Views under one sky have one gain: of few photographs of one place, each alone shows too little that
/// others see.
void share_gains(const Light& light, std::vector<std::array<double, 3>>& logs, std::vector<char>& fitted) {
  std::map<int, std::vector<int>> views_of_sky;
  for (std::size_t v = 0; v < light.shared.size(); ++v)
    if (light.is_gain(static_cast<int>(v)) && light.shared[v] >= 0)
      views_of_sky[light.shared[v]].push_back(static_cast<int>(v));
  for (const auto& [sky, views] : views_of_sky) {
    std::array<std::vector<double>, 3> gains;
    for (const int v : views)
      for (int c = 0; c < 3 && fitted[v]; ++c) gains[c].push_back(logs[v][c]);
    if (gains[0].empty()) continue;
    std::array<double, 3> shared;
    for (int c = 0; c < 3; ++c) shared[c] = huber_mean(gains[c]);
    for (const int v : views) logs[v] = shared, fitted[v] = 1;
  }
}

bool has_domes(const Light& light) { return light.from == LightSource::kSky; }

/// What is to be taken off the logarithms, so that the gains have one scale: their mean, or, where views have
/// the light of their dome, the mean of what these are off it.
std::array<double, 3> common_scale(const std::vector<std::array<double, 3>>& logs,
                                   const std::vector<char>& fitted, const Light& light) {
  std::array<double, 3> sum{0, 0, 0};
  int counted = 0;
  for (std::size_t v = 0; v < logs.size(); ++v) {
    const int view = static_cast<int>(v);
    if (has_domes(light) && (light.is_gain(view) || !fitted[v])) continue;
    ++counted;
    for (int c = 0; c < 3; ++c)
      sum[c] +=
          has_domes(light) ? logs[v][c] - std::log(static_cast<double>(light.of_view(view)[c])) : logs[v][c];
  }
  for (double& value : sum) value /= std::max(1, counted);
  return sum;
}

int side_of_squares(const Intrinsics& k) { return std::max(1, std::max(k.width, k.height) / kSide); }

}  // namespace

PhotographSquares squares_of(const Photograph& photo, int side, double exposure) {
  const float clipped = exposure == 1 ? kBrightest : std::numeric_limits<float>::infinity();
  const int width = std::max(1, photo.rgb.width() / side), height = std::max(1, photo.rgb.height() / side);
  PhotographSquares squares{side, Image(width, height, 3), Mask(width, height)};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      squares.counted.at(x, y) = square_mean(photo, clipped, side, x, y, squares.rgb.pixel(x, y)) ? 255 : 0;
  return squares;
}

const PhotographSquares& SmallPhotographs::operator()(int view_idx, double exposure) {
  std::optional<PhotographSquares>& of_view = of_views_[view_idx];
  if (!of_view) {
    const View& view = dataset_.views[view_idx];
    of_view = squares_of(load_(view), side_of_squares(view.camera.intrinsics), exposure);
  }
  return *of_view;
}

double SmallPhotographs::bytes(const Dataset& dataset) {
  constexpr double kSquareBytes = 3 * sizeof(float) + 1;
  double bytes = 0;
  for (const View& view : dataset.views) {
    const Intrinsics& k = view.camera.intrinsics;
    const int side = side_of_squares(k);
    bytes += kSquareBytes * (k.width / side) * (k.height / side);
  }
  return bytes;
}

std::optional<std::array<double, 3>> log_gain(const PhotographSquares& photo, const Rendering& rendering,
                                              double exposure) {
  const float darkest = kDarkestPair * static_cast<float>(exposure);
  std::array<std::vector<double>, 3> ratios;
  for (int y = 0; y < rendering.opacity.height(); ++y)
    for (int x = 0; x < rendering.opacity.width(); ++x) {
      const float opacity = *rendering.opacity.pixel(x, y);
      if (opacity < kCovered || photo.counted.at(x, y) == 0) continue;
      const float *seen = photo.rgb.pixel(x, y), *rendered = rendering.rgb.pixel(x, y);
      for (int c = 0; c < 3; ++c)
        if (rendered[c] > darkest * opacity && seen[c] > 0)
          ratios[c].push_back(std::log(static_cast<double>(seen[c]) * opacity / rendered[c]));
    }
  std::array<double, 3> gain;
  for (int c = 0; c < 3; ++c) {
    if (ratios[c].size() < kFewestPixels) return std::nullopt;
    gain[c] = huber_mean(std::move(ratios[c]));
  }
  return gain;
}

namespace {

/// log_gain of every view against the volume; where there is none, the logarithm of its light.
struct LogGains {
  std::vector<std::array<double, 3>> logs;
  std::vector<char> fitted;
};

LogGains log_gains(const Volume& volume, SmallPhotographs& photographs, const Scene& scene,
                   const RunContext& context) {
  const Dataset& dataset = photographs.dataset();
  const LatticeStack stack(volume);
  const std::vector<std::array<float, 3>> colors = radiance_colors(volume, scene.transform, scene.exposure);
  const int views = static_cast<int>(dataset.views.size());
  LogGains gains{std::vector<std::array<double, 3>>(views), std::vector<char>(views, 0)};
  auto& [logs, fitted] = gains;
  parallel_for(views, context.thread_count(), [&, &logs = logs, &fitted = fitted](std::int64_t v, int) {
    context.throw_if_cancelled();
    const int view = static_cast<int>(v);
    const std::array<float, 3> before = scene.light.of_view(view);
    const auto gain = fit_view(stack, colors, dataset, view, photographs(view, scene.exposure), scene);
    fitted[view] = gain.has_value();
    for (int c = 0; c < 3; ++c) logs[view][c] = gain ? (*gain)[c] : std::log(static_cast<double>(before[c]));
  });
  return gains;
}

}  // namespace

GainFit fit_gains(const Volume& volume, SmallPhotographs& photographs, const Scene& scene,
                  const RunContext& context, GainScale held_to) {
  auto [logs, fitted] = log_gains(volume, photographs, scene, context);
  const int views = static_cast<int>(logs.size());
  const std::array<double, 3> scale = held_to == GainScale::kOfViews ? common_scale(logs, fitted, scene.light)
                                                                     : std::array<double, 3>{0, 0, 0};
  if (has_domes(scene.light)) share_gains(scene.light, logs, fitted);
  GainFit fit;
  double squares = 0;
  int gains = 0;
  for (int v = 0; v < views; ++v) {
    fit.of_views.push_back(scene.light.of_view(v));
    if (has_domes(scene.light) && (!scene.light.is_gain(v) || !fitted[v])) continue;
    fit.fitted_views += fitted[v];
    ++gains;
    for (int c = 0; c < 3; ++c) {
      const double log_gain = logs[v][c] - scale[c], gain = std::exp(log_gain);
      squares += log_gain * log_gain;
      fit.of_views[v][c] = static_cast<float>(gain);
      fit.largest_change = std::max(fit.largest_change, std::abs(gain / scene.light.of_view(v)[c] - 1));
    }
  }
  if (gains > 0) fit.spread = std::sqrt(squares / (3.0 * gains));
  return fit;
}

}  // namespace roxel

#include "roxel/solve/background_choice.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "roxel/base/error.h"
#include "roxel/color/color_gaussian.h"
#include "roxel/image/local_light.h"

namespace roxel {

namespace {

constexpr double kUniformShare = 0.9;  ///< of all border pixels near one colour, to call it the background's
constexpr double kNearNoises = 3;

double squared_distance(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

std::array<float, 3> median_color(std::vector<std::array<float, 3>> colors) {
  std::array<float, 3> median{};
  for (int c = 0; c < 3; ++c) {
    const auto middle = colors.begin() + colors.size() / 2;
    std::nth_element(colors.begin(), middle, colors.end(),
                     [c](const auto& a, const auto& b) { return a[c] < b[c]; });
    median[c] = (*middle)[c];
  }
  return median;
}

/// Sets mean and covariance of a known background from the colours near `centre`; returns their share.
double fit_constant(const std::vector<std::array<float, 3>>& colors, const std::array<float, 3>& centre,
                    double radius, Background& background) {
  double mean[3] = {0, 0, 0}, second[6] = {0, 0, 0, 0, 0, 0};
  std::size_t near = 0;
  for (const auto& color : colors) {
    if (squared_distance(color, centre) > radius * radius) continue;
    ++near;
    const double x = color[0], y = color[1], z = color[2];
    const double products[6] = {x * x, y * y, z * z, x * y, x * z, y * z};
    for (int c = 0; c < 3; ++c) mean[c] += color[c];
    for (int c = 0; c < 6; ++c) second[c] += products[c];
  }
  if (near == 0) return 0;
  for (double& m : mean) m /= near;
  const double outer[6] = {mean[0] * mean[0], mean[1] * mean[1], mean[2] * mean[2],
                           mean[0] * mean[1], mean[0] * mean[2], mean[1] * mean[2]};
  for (int c = 0; c < 3; ++c) background.mean[c] = static_cast<float>(mean[c]);
  for (int c = 0; c < 6; ++c) background.cov[c] = static_cast<float>(second[c] / near - outer[c]);
  return static_cast<double>(near) / colors.size();
}

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f %%", 100 * share);
  return text;
}

void set_known(const std::array<float, 3>& color, Background& background) {
  background.kind = BackgroundKind::kKnown;
  std::copy(color.begin(), color.end(), background.mean);
  std::fill(background.cov, background.cov + 6, 0.0f);
}

std::array<float, 3> in_matching_space(const std::array<double, 3>& rgb, const Scene& scene) {
  std::array<float, 3> color{static_cast<float>(rgb[0]), static_cast<float>(rgb[1]),
                             static_cast<float>(rgb[2])};
  scene.transform.from_rgb(color.data(), color.data());
  return color;
}

/// Of views whose sky is not known, where colours are compared without local light: what is smooth, the sky
/// above all, then looks like mean grey, with half its tint (docs/light.md).
void expect_smooth(Scene& scene) {
  constexpr float kSmoothShare = 0.5f, kBrighter = 0.1f, kTint = 0.25f;
  std::vector<std::array<float, 3>> colors;
  for (const float brighter : {-kBrighter, 0.0f, kBrighter})
    for (const float tint : {-kTint, 0.0f, kTint}) {
      const float grey = static_cast<float>(LocalLightOptions().mean_level) * std::exp(brighter);
      std::array<float, 3> color{grey * std::exp(tint), grey, grey * std::exp(-tint)};
      scene.transform.from_rgb(color.data(), color.data());
      colors.push_back(color);
    }
  fit_constant(colors, colors.front(), 1e9, scene.background);
  scene.background.smooth_share = kSmoothShare;
}

void choose_automatically(const std::vector<std::array<float, 3>>& colors, Scene& scene) {
  const double noise = std::sqrt(scene.model.noise_variance[0]);
  if (!colors.empty()) {
    Background fitted;
    const double share = fit_constant(colors, median_color(colors), kNearNoises * noise, fitted);
    if (share >= kUniformShare) {
      fitted.kind = BackgroundKind::kKnown;
      fitted.unknown_likelihood = scene.background.unknown_likelihood;
      scene.background = fitted;
      scene.notes.push_back("background: constant, because " + percent(share) +
                            " of the pixels along the images' borders have one colour");
      return;
    }
    scene.notes.push_back("background: unknown, because there are no masks and only " + percent(share) +
                          " of the pixels along the images' borders have one colour");
  }
  scene.background.kind = BackgroundKind::kUnknown;
}

/// A colour that is given is meant to be used.
BackgroundChoice chosen_kind(const ReconstructOptions& options) {
  if (!options.background_color || options.background == BackgroundChoice::kConstant)
    return options.background;
  if (options.background == BackgroundChoice::kAuto) return BackgroundChoice::kConstant;
  throw_invalid("--background-color", "another --background", "--background constant, or none given");
}

[[noreturn]] void throw_without_sky(const Daylight* daylight) {
  const std::string reasons = daylight ? reasons_without_light(*daylight) : "";
  throw_invalid("--background sky",
                "no photograph whose sky is known" + (reasons.empty() ? "" : ": " + reasons),
                "photographs that show the sky, or another --background");
}

}  // namespace

BorderSample sample_border(const Photograph& photo) {
  BorderSample sample;
  sample.has_mask = !photo.foreground.empty();
  const int width = photo.rgb.width(), height = photo.rgb.height();
  const int stride = std::max(1, 2 * (width + height) / 512);
  const auto add = [&](int x, int y) {
    if (!photo.valid.empty() && photo.valid.at(x, y) == 0) return;
    const float* rgb = photo.rgb.pixel(x, y);
    sample.colors.push_back({rgb[0], rgb[1], rgb[2]});
  };
  const int inset = std::min({2, width - 1, height - 1});
  for (int x = 0; x < width; x += stride) add(x, inset), add(x, height - 1 - inset);
  for (int y = 0; y < height; y += stride) add(inset, y), add(width - 1 - inset, y);
  return sample;
}

void choose_background(const std::vector<BorderSample>& borders, const ReconstructOptions& options,
                       const Daylight* daylight, Scene& scene) {
  std::size_t masked = 0;
  const bool sky_masks = daylight && daylight->has_masks();
  std::vector<std::array<float, 3>> colors;
  for (const BorderSample& border : borders) {
    masked += border.has_mask;
    scene.masked.push_back(border.has_mask);
    for (std::array<float, 3> color : border.colors) {
      for (float& c : color) c /= static_cast<float>(scene.exposure);
      scene.transform.from_rgb(color.data(), color.data());
      colors.push_back(color);
    }
  }
  Background& background = scene.background;
  switch (chosen_kind(options)) {
    case BackgroundChoice::kNone:
      background.kind = BackgroundKind::kNone;
      return;
    case BackgroundChoice::kUnknown:
      background.kind = BackgroundKind::kUnknown;
      return;
    case BackgroundChoice::kBlack:
      return set_known(in_matching_space({0, 0, 0}, scene), background);
    case BackgroundChoice::kConstant:
      background.kind = BackgroundKind::kKnown;
      if (options.background_color)
        return set_known(in_matching_space(*options.background_color, scene), background);
      if (colors.empty()) throw_invalid("--background constant", "no image border", "images with pixels");
      fit_constant(colors, median_color(colors), 1e9, background);
      return;
    case BackgroundChoice::kMask:
      if (masked < borders.size())
        throw_invalid("--background mask",
                      std::to_string(masked) + " masks for " + std::to_string(borders.size()) + " images",
                      "a mask for every image");
      background.kind = BackgroundKind::kMask;
      return;
    case BackgroundChoice::kSky:
      if (!sky_masks) throw_without_sky(daylight);
      break;
    case BackgroundChoice::kAuto:
      break;
  }
  if (!borders.empty() && (masked == borders.size() || (sky_masks && masked > 0))) {
    background.kind = BackgroundKind::kMask;
    if (masked < borders.size() && scene.light.local_matching) expect_smooth(scene);
    scene.notes.push_back(masked == borders.size()
                              ? "background: mask, because every image has one"
                              : "background: mask, and unknown for the " +
                                    std::to_string(borders.size() - masked) + " of " +
                                    std::to_string(borders.size()) + " images whose sky is not known");
    return;
  }
  choose_automatically(colors, scene);
}

}  // namespace roxel

/// Figures 4.3 to 4.11 of the thesis from the library's own colour functions:
///
///     agreement_figures FOLDER [SEED]
///
/// Writes figure_4_*.svg and agreement.csv. "sRGB" are values as photographs store them, "RGB" is linear
/// light; every space has the noise that `roxel reconstruct` grants it (4 times that in fields of cells), the
/// scale of exponential agreement is its 2.5 times, linear agreement is that of eq. (4.1) with a threshold.
/// Colours mix as light does, in linear RGB.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "color_panels.h"
#include "matchers.h"
#include "roxel/base/atomic_file.h"
#include "roxel/report/svg_plot.h"

namespace {

using namespace roxel;
namespace fs = std::filesystem;

constexpr int kSteps = 100, kPairs = 50;
constexpr double kWideNoises = 4;  // figures 4.4 to 4.6 and 4.11: wide enough to be seen

LinearRgb mix(const LinearRgb& a, const LinearRgb& b, double share) {
  return {(1 - share) * a.r + share * b.r, (1 - share) * a.g + share * b.g, (1 - share) * a.b + share * b.b};
}

const LinearRgb kBlack{0, 0, 0};

/// What becomes of a reference patch as x goes from 0 to 1, all of it another.
struct Experiment {
  std::string number, title, x_label;
  double shown;  // the graphs end at this x
  std::function<Patch(const LinearRgb& reference, const LinearRgb& other, double x)> target;
};

std::vector<Experiment> experiments() {
  return {{"4_7", "Change of colour", "share of another colour mixed in", 0.5,
           [](const LinearRgb& a, const LinearRgb& b, double x) {
             return Patch{{1.0f, mix(a, b, x)}};
           }},
          {"4_8", "Across a colour boundary", "share of the patch in another colour", 1,
           [](const LinearRgb& a, const LinearRgb& b, double x) {
             return Patch{{static_cast<float>(1 - x), a}, {static_cast<float>(x), b}};
           }},
          {"4_9", "Change of light", "light taken away", 0.5,
           [](const LinearRgb& a, const LinearRgb&, double x) {
             return Patch{{1.0f, mix(a, kBlack, x)}};
           }},
          {"4_10", "Across the boundary of a shadow", "share of the patch at half the light", 1,
           [](const LinearRgb& a, const LinearRgb&, double x) {
             return Patch{{static_cast<float>(1 - x), a}, {static_cast<float>(x), mix(a, kBlack, 0.5)}};
           }}};
}

using Pair = std::pair<LinearRgb, LinearRgb>;

/// Brick against a slate blue: neither dark nor pure.
const Pair kOnePair{decode(EncodedRgb{0.72, 0.42, 0.33}), decode(EncodedRgb{0.35, 0.5, 0.65})};

/// Uniform in what a screen can show.
std::vector<Pair> random_pairs(std::uint32_t seed) {
  std::mt19937 engine(seed);
  const auto uniform = [&engine] { return static_cast<double>(engine()) / 4294967296.0; };
  const auto color = [&uniform] {
    EncodedRgb encoded{};
    encoded.r = uniform();
    encoded.g = uniform();
    encoded.b = uniform();
    return decode(encoded);
  };
  std::vector<Pair> pairs(kPairs);
  for (Pair& pair : pairs) {
    pair.first = color();
    pair.second = color();
  }
  return pairs;
}

std::vector<double> steps() {
  std::vector<double> x(kSteps + 1);
  for (int i = 0; i <= kSteps; ++i) x[i] = static_cast<double>(i) / kSteps;
  return x;
}

std::vector<double> curve(const Experiment& experiment, const Matcher& matcher, const Pair& pair) {
  std::vector<double> y;
  for (const double x : steps())
    y.push_back(matcher({{1.0f, pair.first}}, experiment.target(pair.first, pair.second, x)));
  return y;
}

std::vector<double> mean_curve(const Experiment& experiment, const Matcher& matcher,
                               const std::vector<Pair>& pairs) {
  std::vector<double> mean(kSteps + 1);
  for (const Pair& pair : pairs) {
    const std::vector<double> y = curve(experiment, matcher, pair);
    for (int i = 0; i <= kSteps; ++i) mean[i] += y[i] / static_cast<double>(pairs.size());
  }
  return mean;
}

/// The part of a curve that a graph shows.
PlotSeries shown(const Experiment& experiment, PlotSeries series) {
  const auto count = static_cast<std::size_t>(std::lround(experiment.shown * kSteps)) + 1;
  series.x.resize(count);
  series.y.resize(count);
  return series;
}

/// Left graph: one pair of colours, all matchers.
Plot one_pair_plot(const Experiment& experiment) {
  Plot plot{experiment.title, {experiment.x_label, 0, experiment.shown}, {"agreement", 0, 1}, {}};
  for (const Matcher& matcher : matchers())
    plot.series.push_back(shown(experiment, {matcher.name, steps(), curve(experiment, matcher, kOnePair)}));
  return plot;
}

/// Right graph: fifty random pairs in Luv, one thin line each, and their mean.
Plot random_pairs_plot(const Experiment& experiment, const std::vector<Pair>& pairs) {
  const Matcher luv = gaussian_matcher("Luv", ColorSpace::kLuv);
  PlotSeries each{"fifty random pairs, Luv", {}, {}, PlotStyle::kThin};
  for (const Pair& pair : pairs) {
    const PlotSeries one = shown(experiment, {"", steps(), curve(experiment, luv, pair)});
    each.x.insert(each.x.end(), one.x.begin(), one.x.end());
    each.y.insert(each.y.end(), one.y.begin(), one.y.end());
    each.x.push_back(experiment.shown);
    each.y.push_back(std::numeric_limits<double>::quiet_NaN());  // lifts the pen
  }
  const PlotSeries mean =
      shown(experiment, {"their mean", steps(), mean_curve(experiment, luv, pairs), PlotStyle::kDashes});
  return {experiment.title, {experiment.x_label, 0, experiment.shown}, {"agreement", 0, 1}, {each, mean}};
}

/// Figure 4.3, in one dimension: with spread along one axis alone the others' factors are 1.
Plot spread_plot() {
  const GaussianAgreement agree(1);
  Plot plot{"Agreement by difference and spread",
            {"difference of the means [noise]", 0, 10},
            {"agreement", 0, 1},
            {}};
  for (const float spread : {0.0f, 1.0f, 2.0f, 4.0f, 8.0f}) {
    PlotSeries series{
        (plot.series.empty() ? "spread " : "") + std::to_string(static_cast<int>(spread)), {}, {}};
    for (int i = 0; i <= 100; ++i) {
      ColorGaussian a, b;
      a.mean[0] = 0.1f * static_cast<float>(i);
      a.cov[0] = spread * spread;
      series.x.push_back(a.mean[0]);
      series.y.push_back(agree(a, b));
    }
    plot.series.push_back(series);
  }
  return plot;
}

/// A plane through the cube of stored colours: colour at (x, y) in [0, 1]^2, y upwards.
using Slice = std::function<EncodedRgb(double x, double y)>;

bool in_cube(const EncodedRgb& c) { return std::min({c.r, c.g, c.b}) >= 0 && std::max({c.r, c.g, c.b}) <= 1; }

CellPanel panel_of(const std::string& title, int columns, int rows, const Slice& slice,
                   const std::function<std::string(const LinearRgb&)>& fill) {
  CellPanel panel{title, columns, rows, {}};
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const EncodedRgb color = slice((column + 0.5) / columns, 1 - (row + 0.5) / rows);
      panel.fills.push_back(in_cube(color) ? fill(decode(color)) : "");
    }
  return panel;
}

/// Black is the best that any colour agrees.
CellPanel agreement_panel(const Matcher& matcher, const Patch& reference, const Slice& slice) {
  return panel_of(matcher.name, 60, 45, slice, [&](const LinearRgb& color) {
    return agreement_fill(matcher(reference, {{1.0f, color}}) / matcher.best(reference));
  });
}

std::string slice_svg(const std::string& title, const Patch& reference, const Slice& slice,
                      const std::vector<Matcher>& by, const std::string& x_label,
                      const std::string& y_label) {
  std::vector<CellPanel> panels{panel_of("colours", 24, 18, slice, color_fill)};
  for (const Matcher& matcher : by) panels.push_back(agreement_panel(matcher, reference, slice));
  return svg_panels(title, panels, x_label, y_label);
}

const Patch kBlueAndYellow{{0.5f, {0, 0, 1}}, {0.5f, {1, 1, 0}}};

/// Figures 4.4 to 4.6: a plane of the cube that holds the reference.
void write_cube_figures(const fs::path& folder) {
  const std::vector<Matcher> by{gaussian_matcher("sRGB", ColorSpace::kSrgb, kWideNoises),
                                gaussian_matcher("Luv", ColorSpace::kLuv, kWideNoises)};
  const auto write = [&](const char* name, const std::string& svg) {
    write_text_atomically(folder / name, svg);
  };
  const Patch grey{{1.0f, decode(EncodedRgb{0.5, 0.5, 0.5})}};
  const Slice greys = [](double x, double y) {
    const double s = 1.5 * (x - 0.5);
    return EncodedRgb{y + s, y - s / 2, y - s / 2};
  };
  write("figure_4_4.svg",
        slice_svg("Agreement with the middle grey", grey, greys, by, "cyan to red", "black to white"));
  const Patch red{{1.0f, {1, 0, 0}}};
  const Slice reds = [](double x, double y) { return EncodedRgb{1, x, y}; };
  write("figure_4_5.svg", slice_svg("Agreement with pure red", red, reds, by, "green", "blue"));
  const Slice blue_yellow = [](double x, double y) { return EncodedRgb{y, y, x}; };
  write("figure_4_6a.svg", slice_svg("Agreement with blue and yellow", kBlueAndYellow, blue_yellow, by,
                                     "blue", "red and green together"));
  const Slice across = [](double x, double y) { return EncodedRgb{y, x, 0.5}; };
  write("figure_4_6b.svg",
        slice_svg("The same across, where blue is half", kBlueAndYellow, across, by, "green", "red"));
}

/// The image of figure 4.11: hue goes to the right, light upwards from a quarter to all; its middle is an
/// orange.
EncodedRgb color_by_light(double x, double y) {
  const EncodedRgb full = encoded_from_hsv({std::fmod(1 + 1 / 12.0 + 0.5 * (x - 0.5), 1.0), 0.6, 1});
  return encode(mix(kBlack, decode(full), 0.25 + 0.75 * y));
}

/// How far from the middle, in x or y, agreement stays above one half; the image ends at 0.5.
double half_reach(const Matcher& matcher, bool upwards) {
  const Patch middle{{1.0f, decode(color_by_light(0.5, 0.5))}};
  int kept = 0;
  for (const int sign : {-1, 1})
    for (int i = 1; i <= 500; ++i, ++kept) {
      const double at = 0.5 + sign * 0.001 * i;
      const EncodedRgb color = upwards ? color_by_light(0.5, at) : color_by_light(at, 0.5);
      if (matcher(middle, {{1.0f, decode(color)}}) < 0.5f) break;
    }
  return 0.001 * kept / 2;
}

void write_color_by_light(const fs::path& folder) {
  const Patch middle{{1.0f, decode(color_by_light(0.5, 0.5))}};
  std::vector<Matcher> by = matchers(kWideNoises);
  by.pop_back();  // the thesis's four
  write_text_atomically(folder / "figure_4_11.svg", slice_svg("Agreement with the colour in the middle",
                                                              middle, color_by_light, by, "hue", "light"));
}

/// Where a falling curve crosses one half; 1 where it never does.
double half_change(const std::vector<double>& y) {
  for (int i = 1; i <= kSteps; ++i)
    if (y[i] < 0.5) return (i - 1 + (y[i - 1] - 0.5) / (y[i - 1] - y[i])) / kSteps;
  return 1;
}

std::string line(const std::string& figure, const std::string& matcher, const std::string& what,
                 double value) {
  char text[200];
  std::snprintf(text, sizeof text, "%s,%s,%s,%.4f\n", figure.c_str(), matcher.c_str(), what.c_str(), value);
  return text;
}

/// The figures in figures: where agreement falls to one half, and what is left at the end.
std::string key_figures(const std::vector<Pair>& pairs) {
  std::string out = "figure,agreement,what,value\n";
  for (const Matcher& matcher : matchers()) {
    for (const Experiment& experiment : experiments()) {
      const std::vector<double> one = curve(experiment, matcher, kOnePair);
      const std::vector<double> mean = mean_curve(experiment, matcher, pairs);
      out += line(experiment.number, matcher.name, "one pair: half at", half_change(one));
      out += line(experiment.number, matcher.name, "one pair: at 0.5", one[kSteps / 2]);
      out += line(experiment.number, matcher.name, "mean of pairs: half at", half_change(mean));
      out += line(experiment.number, matcher.name, "mean of pairs: at 0.5", mean[kSteps / 2]);
    }
  }
  for (const Matcher& matcher : matchers(kWideNoises)) {
    out += line("4_6", matcher.name, "best agreement", matcher.best(kBlueAndYellow));
    out += line("4_11", matcher.name, "reach in hue", half_reach(matcher, false));
    out += line("4_11", matcher.name, "reach in light", half_reach(matcher, true));
  }
  return out;
}

void write_figures(const fs::path& folder, std::uint32_t seed) {
  const std::vector<Pair> pairs = random_pairs(seed);
  write_text_atomically(folder / "figure_4_3.svg", svg_plot(spread_plot()));
  write_cube_figures(folder);
  for (const Experiment& experiment : experiments()) {
    const std::string stem = "figure_" + experiment.number;
    write_text_atomically(folder / (stem + "a.svg"), svg_plot(one_pair_plot(experiment)));
    write_text_atomically(folder / (stem + "b.svg"), svg_plot(random_pairs_plot(experiment, pairs)));
  }
  write_color_by_light(folder);
  write_text_atomically(folder / "agreement.csv", key_figures(pairs));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: %s FOLDER [SEED]\n", argv[0]);
    return 2;
  }
  try {
    write_figures(argv[1], argc > 2 ? static_cast<std::uint32_t>(std::strtoul(argv[2], nullptr, 10)) : 1);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 1;
  }
  return 0;
}

#pragma once
/// Plots as SVG: lines, bars and points on two axes. Legible on a phone and in black and white.

#include <optional>
#include <string>
#include <vector>

namespace roxel {

struct PlotAxis {
  std::string label;               ///< with its unit: "distance [voxels]"
  std::optional<double> low = {};  ///< ends of the axis; none: from the data
  std::optional<double> high = {};
  bool logarithmic = false;  ///< values that are not above 0 are left out
};

enum class PlotStyle {
  kLine,
  kDashes,
  kThin,  ///< pale lines, of which many lie over each other
  kPoints,
  kBars,
};

/// One set of values. Bars stand on the lower end of the y axis, from x to x + bar_width.
struct PlotSeries {
  std::string name;  ///< in the legend; empty: not there
  std::vector<double> x, y;
  PlotStyle style = PlotStyle::kLine;
  double bar_width = 1;
};

struct Plot {
  std::string title;
  PlotAxis x, y;
  std::vector<PlotSeries> series;
};

/// An <svg> element of 480 x 320 units that scales with its surroundings. Values that are not finite leave a
/// gap.
std::string svg_plot(const Plot& plot);

/// Where an axis from low to high has its marks: steps of 1, 2 or 5 times a power of ten, at most `most`.
std::vector<double> axis_ticks(double low, double high, int most);

}  // namespace roxel

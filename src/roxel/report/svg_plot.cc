#include "roxel/report/svg_plot.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "roxel/base/error.h"
#include "roxel/base/formatted.h"
#include "roxel/report/markup.h"

namespace roxel {
namespace {

constexpr double kWidth = 480, kHeight = 320;
constexpr double kLeft = 64, kRight = 14, kTop = 34, kBottom = 50;
constexpr int kMostTicks = 6;
/// Told apart by people who do not see all colours, and by their greys.
constexpr std::array<const char*, 6> kColors{"#0072b2", "#d55e00", "#009e73",
                                             "#cc79a7", "#56b4e9", "#000000"};
constexpr std::array<const char*, 6> kDashes{"", "7 4", "2 3", "9 3 2 3", "4 4", "1 4"};

/// An axis with its ends known, and where values lie between them.
class Scale {
 public:
  Scale(const PlotAxis& axis, double low, double high, double from, double to)
      : logarithmic_(axis.logarithmic), from_(from), to_(to) {
    low_ = axis.low.value_or(low);
    high_ = axis.high.value_or(high);
    if (!(high_ > low_)) high_ = low_ + (logarithmic_ ? low_ : std::max(1.0, std::abs(low_)));
  }

  double low() const { return low_; }
  double high() const { return high_; }

  bool shows(double value) const { return std::isfinite(value) && (!logarithmic_ || value > 0); }

  double at(double value) const {
    const double share =
        logarithmic_ ? std::log(value / low_) / std::log(high_ / low_) : (value - low_) / (high_ - low_);
    return from_ + std::clamp(share, 0.0, 1.0) * (to_ - from_);
  }

  std::vector<double> ticks() const {
    if (!logarithmic_) return axis_ticks(low_, high_, kMostTicks);
    std::vector<double> decades;
    for (double p = std::ceil(std::log10(low_) - 1e-9); p <= std::log10(high_) + 1e-9; ++p)
      decades.push_back(std::pow(10, p));
    return decades.size() >= 2 ? decades : std::vector<double>{low_, high_};
  }

 private:
  bool logarithmic_;
  double from_, to_, low_, high_;
};

struct Range {
  double low = INFINITY, high = -INFINITY;
  void take(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

/// Ends that leave data a little room; bars stand on 0.
Range padded(Range range, const PlotAxis& axis, bool bars) {
  if (!(range.low <= range.high)) return axis.logarithmic ? Range{0.1, 1} : Range{0, 1};
  if (axis.logarithmic)
    return {std::pow(10, std::floor(std::log10(range.low))), std::pow(10, std::ceil(std::log10(range.high)))};
  if (bars) range.low = std::min(range.low, 0.0);
  const double room = 0.04 * (range.high - range.low);
  if (range.low != 0) range.low -= room;
  range.high += room;
  return range;
}

class Drawing {
 public:
  explicit Drawing(const Plot& plot)
      : plot_(plot),
        ranges_(ranges(plot)),
        x_(plot.x, ranges_[0].low, ranges_[0].high, kLeft, kWidth - kRight),
        y_(plot.y, ranges_[1].low, ranges_[1].high, kHeight - kBottom, kTop + legend_height()) {}

  std::string svg() {
    out_ = formatted(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %g %g\" role=\"img\" "
        "font-family=\"sans-serif\" "
        "font-size=\"13\"><title>%s</title>\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
        kWidth, kHeight, escape_markup(plot_.title).substr(0, 200).c_str());
    draw_axes();
    for (std::size_t i = 0; i < plot_.series.size(); ++i) draw(plot_.series[i], i);
    draw_texts();
    return out_ + "</svg>\n";
  }

 private:
  static std::array<Range, 2> ranges(const Plot& plot) {
    Range x, y;
    bool bars = false;
    for (const PlotSeries& series : plot.series) {
      ROXEL_CHECK_EQ(series.x.size(), series.y.size());
      const bool is_bars = series.style == PlotStyle::kBars;
      bars = bars || is_bars;
      for (std::size_t i = 0; i < series.x.size(); ++i) {
        const bool shown = std::isfinite(series.x[i]) && std::isfinite(series.y[i]) &&
                           !(plot.x.logarithmic && series.x[i] <= 0) &&
                           !(plot.y.logarithmic && series.y[i] <= 0);
        if (!shown) continue;
        x.take(series.x[i]);
        if (is_bars) x.take(series.x[i] + series.bar_width);
        y.take(series.y[i]);
      }
    }
    const Range across = x.low <= x.high ? x : Range{0, 1};  // without room to the sides
    return {across, padded(y, plot.y, bars)};
  }

  bool has_legend() const {
    return std::any_of(plot_.series.begin(), plot_.series.end(),
                       [](const PlotSeries& s) { return !s.name.empty(); });
  }
  double legend_height() const { return has_legend() ? 20 : 0; }

  static std::string tick_text(double value) {
    const double size = std::abs(value);
    if (size >= 1e6) return short_number(value / 1e6) + "M";
    if (size >= 1e4) return short_number(value / 1e3) + "k";
    return short_number(value);
  }

  void draw_axes() {
    const double bottom = kHeight - kBottom, top = kTop + legend_height();
    for (const double tick : x_.ticks()) {
      const double at = x_.at(tick);
      out_ += formatted(
          "<path d=\"M%.1f %.1fV%.1f\" stroke=\"#ddd\"/><text x=\"%.1f\" y=\"%.1f\" "
          "text-anchor=\"middle\">%s</text>\n",
          at, bottom, top, at, bottom + 17, tick_text(tick).c_str());
    }
    for (const double tick : y_.ticks()) {
      const double at = y_.at(tick);
      out_ += formatted(
          "<path d=\"M%.1f %.1fH%.1f\" stroke=\"#ddd\"/><text x=\"%.1f\" y=\"%.1f\" "
          "text-anchor=\"end\">%s</text>\n",
          kLeft, at, kWidth - kRight, kLeft - 6, at + 4.5, tick_text(tick).c_str());
    }
    out_ += formatted("<path d=\"M%.1f %.1fV%.1fH%.1f\" fill=\"none\" stroke=\"#333\"/>\n", kLeft, top,
                      bottom, kWidth - kRight);
  }

  void draw(const PlotSeries& series, std::size_t idx) {
    switch (series.style) {
      case PlotStyle::kBars:
        return draw_bars(series, idx);
      case PlotStyle::kPoints:
        return draw_points(series, idx);
      default:
        return draw_line(series, idx);
    }
  }

  static const char* color(std::size_t idx) { return kColors[idx % kColors.size()]; }
  static const char* dashes(const PlotSeries& series, std::size_t idx) {
    if (series.style == PlotStyle::kThin) return "";
    return series.style == PlotStyle::kDashes ? "5 4" : kDashes[idx % kDashes.size()];
  }
  static const char* width(const PlotSeries& series) {
    return series.style == PlotStyle::kThin ? "0.7\" stroke-opacity=\"0.5" : "2";
  }

  bool shows(const PlotSeries& series, std::size_t i) const {
    return x_.shows(series.x[i]) && y_.shows(series.y[i]);
  }

  void draw_bars(const PlotSeries& series, std::size_t idx) {
    const double ground = y_.at(plot_.y.logarithmic ? y_.low() : std::clamp(0.0, y_.low(), y_.high()));
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      if (!shows(series, i)) continue;
      const double left = x_.at(series.x[i]), right = x_.at(series.x[i] + series.bar_width),
                   end = y_.at(series.y[i]);
      out_ += formatted(
          "<rect x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"%.2f\" fill=\"%s\" stroke=\"#fff\" "
          "stroke-width=\"0.5\"/>",
          left, std::min(end, ground), right - left, std::abs(ground - end), color(idx));
    }
    out_ += "\n";
  }

  void draw_points(const PlotSeries& series, std::size_t idx) {
    for (std::size_t i = 0; i < series.x.size(); ++i)
      if (shows(series, i)) draw_point(series, i, idx);
    out_ += "\n";
  }

  void draw_point(const PlotSeries& series, std::size_t i, std::size_t idx) {
    out_ += formatted("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3\" fill=\"%s\"/>", x_.at(series.x[i]),
                      y_.at(series.y[i]), color(idx));
  }

  void draw_line(const PlotSeries& series, std::size_t idx) {
    std::string path;
    bool down = false;
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      const bool shown = shows(series, i);
      const bool alone = shown && !down && (i + 1 == series.x.size() || !shows(series, i + 1));
      if (alone) draw_point(series, i, idx);
      if (shown) path += formatted("%s%.1f %.1f", down ? "L" : "M", x_.at(series.x[i]), y_.at(series.y[i]));
      down = shown;
    }
    if (path.empty()) return;
    out_ += "<path d=\"" + path +
            formatted("\" fill=\"none\" stroke=\"%s\" stroke-width=\"%s\" stroke-dasharray=\"%s\"/>\n",
                      color(idx), width(series), dashes(series, idx));
  }

  void draw_texts() {
    out_ += formatted("<text x=\"%.1f\" y=\"20\" font-size=\"15\" font-weight=\"bold\">", 12.0) +
            escape_markup(plot_.title) + "</text>\n";
    out_ += formatted("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">", (kLeft + kWidth - kRight) / 2,
                      kHeight - 10) +
            escape_markup(plot_.x.label) + "</text>\n";
    out_ += formatted("<text transform=\"translate(14 %.1f) rotate(-90)\" text-anchor=\"middle\">",
                      (kTop + kHeight - kBottom) / 2) +
            escape_markup(plot_.y.label) + "</text>\n";
    double left = kLeft;
    for (std::size_t i = 0; i < plot_.series.size(); ++i) {
      const PlotSeries& series = plot_.series[i];
      if (series.name.empty()) continue;
      if (series.style == PlotStyle::kPoints)
        out_ += formatted("<circle cx=\"%.1f\" cy=\"40\" r=\"3\" fill=\"%s\"/>", left + 12, color(i));
      else if (series.style == PlotStyle::kBars)
        out_ +=
            formatted("<rect x=\"%.1f\" y=\"36\" width=\"16\" height=\"8\" fill=\"%s\"/>", left, color(i));
      else
        out_ +=
            formatted("<path d=\"M%.1f 40h24\" stroke=\"%s\" stroke-width=\"%s\" stroke-dasharray=\"%s\"/>",
                      left, color(i), width(series), dashes(series, i));
      out_ += formatted("<text x=\"%.1f\" y=\"44\">", left + 28) + escape_markup(series.name) + "</text>\n";
      left += 42 + 7.0 * static_cast<double>(series.name.size());
    }
  }

  const Plot& plot_;
  std::array<Range, 2> ranges_;
  Scale x_, y_;
  std::string out_;
};

}  // namespace

std::vector<double> axis_ticks(double low, double high, int most) {
  ROXEL_CHECK(high > low && most > 0);
  double step = std::pow(10, std::floor(std::log10((high - low) / most)));
  for (const double factor : {1.0, 2.0, 5.0, 10.0})
    if (std::floor(high / (factor * step)) - std::ceil(low / (factor * step)) + 1 <= most) {
      step *= factor;
      break;
    }
  std::vector<double> ticks;
  for (double i = std::ceil(low / step - 1e-9); i <= high / step + 1e-9; ++i)
    ticks.push_back(i == 0 ? 0.0 : i * step);
  return ticks;
}

std::string svg_plot(const Plot& plot) { return Drawing(plot).svg(); }

}  // namespace roxel

#include "color_panels.h"

#include <cmath>
#include <map>

#include "roxel/base/error.h"
#include "roxel/base/formatted.h"
#include "roxel/color/response.h"
#include "roxel/report/markup.h"

namespace roxel {
namespace {

constexpr int kWidth = 200, kHeight = 150, kGap = 12, kLeft = 24, kTop = 56, kBottom = 28;
constexpr int kLevels = 15;

/// One path a fill, each run of equal cells in a row one rectangle of it: cells are the units.
std::string cell_paths(const CellPanel& panel) {
  std::map<std::string, std::string> paths;
  for (int row = 0; row < panel.rows; ++row)
    for (int column = 0; column < panel.columns;) {
      const std::string& fill = panel.fills[row * panel.columns + column];
      const int begin = column;
      while (column < panel.columns && panel.fills[row * panel.columns + column] == fill) ++column;
      if (!fill.empty())
        paths[fill] += formatted("M%d %dh%dv1h-%dz", begin, row, column - begin, column - begin);
    }
  std::string out;
  for (const auto& [fill, path] : paths) out += "<path fill=\"" + fill + "\" d=\"" + path + "\"/>\n";
  return out;
}

std::string draw_panel(const CellPanel& panel, int left) {
  ROXEL_CHECK_EQ(panel.fills.size(), static_cast<std::size_t>(panel.columns) * panel.rows);
  const double x_scale = static_cast<double>(kWidth) / panel.columns;
  const double y_scale = static_cast<double>(kHeight) / panel.rows;
  return formatted("<text x=\"%d\" y=\"%d\">", left, kTop - 8) + escape_markup(panel.title) + "</text>\n" +
         formatted("<g transform=\"translate(%d %d) scale(%.4f %.4f)\" shape-rendering=\"crispEdges\">\n",
                   left, kTop, x_scale, y_scale) +
         cell_paths(panel) + "</g>\n" +
         formatted("<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" fill=\"none\" stroke=\"#333\"/>\n",
                   left, kTop, kWidth, kHeight);
}

}  // namespace

std::string agreement_fill(float agreement) {
  const int grey = 255 - static_cast<int>(std::lround(agreement * kLevels)) * (255 / kLevels);
  return formatted("#%02x%02x%02x", grey, grey, grey);
}

std::string color_fill(const LinearRgb& color) {
  const auto code = [](double light) { return encode_8bit(Response{}, static_cast<float>(light)); };
  return formatted("#%02x%02x%02x", code(color.r), code(color.g), code(color.b));
}

std::string svg_panels(const std::string& title, const std::vector<CellPanel>& panels,
                       const std::string& x_label, const std::string& y_label) {
  const int count = static_cast<int>(panels.size());
  const int width = kLeft + count * (kWidth + kGap), height = kTop + kHeight + kBottom;
  std::string out = formatted(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" role=\"img\" "
      "font-family=\"sans-serif\" font-size=\"13\"><rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
      width, height);
  out +=
      "<text x=\"12\" y=\"20\" font-size=\"15\" font-weight=\"bold\">" + escape_markup(title) + "</text>\n";
  for (int i = 0; i < count; ++i) out += draw_panel(panels[i], kLeft + i * (kWidth + kGap));
  out += formatted("<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">", width / 2, height - 9) +
         escape_markup(x_label) + "</text>\n";
  out += formatted("<text transform=\"translate(15 %d) rotate(-90)\" text-anchor=\"middle\">",
                   kTop + kHeight / 2) +
         escape_markup(y_label) + "</text>\n";
  return out + "</svg>\n";
}

}  // namespace roxel

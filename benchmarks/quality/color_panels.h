#pragma once
/// Fields of small cells side by side as one SVG: colours as they are, agreements as shades of grey.

#include <string>
#include <vector>

#include "roxel/color/color_space.h"

namespace roxel {

/// One field, row by row from the top. A cell's text is its fill; empty: no cell.
struct CellPanel {
  std::string title;
  int columns = 0, rows = 0;
  std::vector<std::string> fills;
};

/// White for 0 to black for 1 in 16 steps.
std::string agreement_fill(float agreement);

/// What a screen shows of linear light, clamped to what it can show.
std::string color_fill(const LinearRgb& color);

/// An <svg> element with the panels in a row, each of them 4 : 3, under a title, with labels of both axes.
std::string svg_panels(const std::string& title, const std::vector<CellPanel>& panels,
                       const std::string& x_label, const std::string& y_label);

}  // namespace roxel

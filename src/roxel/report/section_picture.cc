#include "roxel/report/section_picture.h"

#include <cmath>
#include <cstdio>
#include <set>

#include "roxel/io/image_bytes.h"
#include "roxel/report/markup.h"

namespace roxel {
namespace {

Image printed(const Image& opacity) {
  Image grey = opacity;
  for (float& value : grey.data()) value = 1 - value;
  return grey;
}

/// To a tenth of a voxel, each piece once: fine enough to look at, however fine the mesh is.
std::string outline_path(const Section& section) {
  const auto tenths = [](double voxels) { return static_cast<int>(std::lround(10 * voxels)); };
  std::set<std::array<int, 4>> pieces;
  for (const auto& [a, b] : section.outline) {
    const Eigen::AlignedBox2d picture(Eigen::Vector2d::Zero(),
                                      Eigen::Vector2d(section.opacity.width(), section.opacity.height()));
    if (!picture.intersects(Eigen::AlignedBox2d(a.cwiseMin(b), a.cwiseMax(b)))) continue;
    const std::array<int, 4> piece{tenths(a.x()), tenths(a.y()), tenths(b.x()), tenths(b.y())};
    if (piece[0] != piece[2] || piece[1] != piece[3]) pieces.insert(piece);
  }
  std::string path;
  char text[64];
  for (const auto& [x0, y0, x1, y1] : pieces) {
    std::snprintf(text, sizeof text, "M%g %gL%g %g", x0 / 10.0, y0 / 10.0, x1 / 10.0, y1 / 10.0);
    path += text;
  }
  return path;
}

}  // namespace

std::string section_name(const Section& section) {
  return std::string(1, "xyz"[section.axis]) + " = " + short_number(section.position);
}

std::string section_svg(const Section& section) {
  const int width = section.opacity.width(), height = section.opacity.height();
  const std::string size = std::to_string(width) + " " + std::to_string(height);
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + size +
                    "\" role=\"img\"><title>section " + section_name(section) + "</title>\n<image width=\"" +
                    std::to_string(width) + "\" height=\"" + std::to_string(height) +
                    "\" style=\"image-rendering:pixelated\" href=\"" +
                    data_uri("image/png", png_bytes(printed(section.opacity))) + "\"/>\n";
  if (const std::string path = outline_path(section); !path.empty())
    svg += "<path d=\"" + path + "\" fill=\"none\" stroke=\"#e00000\" stroke-width=\"" +
           short_number(width / 400.0) + "\"/>\n";
  return svg + "</svg>\n";
}

}  // namespace roxel

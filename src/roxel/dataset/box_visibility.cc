#include "roxel/dataset/box_visibility.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "roxel/dataset/camera_box.h"
#include "roxel/dataset/cell_grid.h"

namespace roxel {
namespace {

constexpr int kVisibilityCells = 16;
constexpr double kFineVoxelPx = 0.4;   // below it a voxel is far under a pixel
constexpr double kCoarseVoxelPx = 16;  // above it the photographs hold much more than the volume
constexpr double kFewViews = 0.5;
constexpr double kLittleOverlap = 0.1;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

/// Which of the grid's cells the view sees.
std::vector<bool> seen_cells(const View& view, const DepthRange& range, const CellGrid& grid) {
  std::vector<bool> seen(grid.cell_count());
  for (std::size_t cell = 0; cell < seen.size(); ++cell) {
    seen[cell] = sees(view, grid.centre(cell), {range.near, range.far});
  }
  return seen;
}

/// Depth at which the view sees the box: of its centre, or of the mean cell seen where the centre is not
/// ahead.
double depth_of_box(const View& view, const CellGrid& grid, const std::vector<bool>& seen) {
  double sum = 0;
  int count = 0;
  for (std::size_t cell = 0; cell < seen.size(); ++cell) {
    if (!seen[cell]) continue;
    sum += view.camera.camera_from_world(grid.centre(cell)).z();
    ++count;
  }
  return sum / count;
}

}  // namespace

BoxVisibility box_visibility(const Dataset& dataset, const SceneBounds& bounds, double voxel_size) {
  const CellGrid grid(bounds.box, kVisibilityCells);
  BoxVisibility result;
  std::vector<int> nodes_seeing(grid.cell_count(), 0);
  std::vector<double> widths_px;
  for (const Node& node : dataset.nodes) {
    std::vector<bool> seen_by_node(grid.cell_count(), false);
    for (int v : node.view_idxs) {
      const View& view = dataset.views[v];
      const std::vector<bool> seen = seen_cells(view, bounds.views[v], grid);
      if (std::none_of(seen.begin(), seen.end(), [](bool s) { return s; })) continue;
      ++result.views;
      widths_px.push_back(voxel_size * view.camera.intrinsics.fx / depth_of_box(view, grid, seen));
      for (std::size_t cell = 0; cell < seen.size(); ++cell) {
        if (seen[cell]) seen_by_node[cell] = true;
      }
    }
    for (std::size_t cell = 0; cell < seen_by_node.size(); ++cell) nodes_seeing[cell] += seen_by_node[cell];
  }
  result.share_seen_twice = static_cast<double>(std::count_if(nodes_seeing.begin(), nodes_seeing.end(),
                                                              [](int n) { return n > 1; })) /
                            static_cast<double>(grid.cell_count());
  if (widths_px.empty()) return result;
  std::sort(widths_px.begin(), widths_px.end());
  result.min_pixels_per_voxel = widths_px.front();
  result.median_pixels_per_voxel = widths_px[widths_px.size() / 2];
  result.max_pixels_per_voxel = widths_px.back();
  return result;
}

std::vector<std::string> scale_warnings(const Dataset& dataset, const SceneBounds& bounds,
                                        double voxel_size) {
  const BoxVisibility seen = box_visibility(dataset, bounds, voxel_size);
  std::vector<std::string> warnings;
  if (seen.views == 0) {
    warnings.push_back("no view sees the box: check --bounds (world units of the cameras), --near and --far");
    return warnings;
  }
  const std::string views =
      std::to_string(seen.views) + " of " + std::to_string(dataset.views.size()) + " views";
  if (seen.views < kFewViews * static_cast<double>(dataset.views.size())) {
    warnings.push_back("only " + views + " see the box: check --bounds, --near and --far");
  }
  if (seen.share_seen_twice == 0) {
    warnings.push_back(
        "no part of the box is seen from two places: nothing there can be reconstructed; move --bounds");
  } else if (seen.share_seen_twice < kLittleOverlap) {
    warnings.push_back("only " + number(100 * seen.share_seen_twice) +
                       " % of the box is seen from two places or more: give a smaller --bounds");
  }
  const double px = seen.median_pixels_per_voxel;
  if (px < kFineVoxelPx) {
    warnings.push_back("a voxel of " + number(voxel_size) + " is " + number(px) +
                       " pixels wide, far under a pixel: use --voxel-size " + number(voxel_size / px) +
                       " or more (or a lower --resolution)");
  } else if (px > kCoarseVoxelPx) {
    warnings.push_back("a voxel of " + number(voxel_size) + " is " + number(px) +
                       " pixels wide: the photographs show far more; use a smaller --voxel-size, a higher "
                       "--resolution, or smaller --bounds");
  }
  return warnings;
}

}  // namespace roxel

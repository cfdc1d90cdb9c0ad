#pragma once
/// Views at a whole fraction of their size: refinement need not look closer than the volume is fine
/// (docs/depth.md).

#include "roxel/dataset/scaled_photograph.h"
#include "roxel/depth/depth_layers.h"
#include "roxel/depth/pixel_plane.h"

namespace roxel {

/// The largest power of two by which views may be made smaller so that the median voxel still is 1.5 pixels
/// across and the median view still has 100 000 pixels (small photographs cost little, and
/// lose much: docs/results/surface.md); at most 16. `voxel_pixels`: pixels that a voxel is across, of each
/// view (0: it has no depth, and says nothing). `view_pixels`: pixels of each view.
int choose_scale(std::vector<double> voxel_pixels, std::vector<double> view_pixels);

/// Pixels of each view.
std::vector<double> pixels_of_views(const Dataset& dataset);

/// Pixels that a voxel is across at the median of the depths; 0 without depth.
double voxel_in_pixels(const Image& depth, double focal_px, double voxel_size);

/// What a pixel of the smaller view takes from the larger one's depth: the surest pixel of its square, -1
/// where none has depth (> 0). Returns indices into the larger image, row by row.
std::vector<std::int64_t> surest_pixels(const Image& depth, const Image& variance, int scale);

/// The smaller view's plane for pixel (x, y) of the larger one: of the four around it, the one whose depth
/// there is closest to `depth`. Slopes are a pixel of the larger view; (column, row): whose it is.
struct PlaneOfPixel {
  PixelPlane plane;  ///< empty where none of the four has any
  int column = 0, row = 0;
};
PlaneOfPixel plane_of_pixel(const PlaneMap& planes, int scale, int x, int y, double depth);

}  // namespace roxel

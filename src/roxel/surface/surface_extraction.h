#pragma once
/// The surface where a signed distance is 0, where views have seen it (docs/surface.md).

#include "roxel/surface/depth_fusion.h"
#include "roxel/surface/surface.h"

namespace roxel {

struct ExtractionOptions {
  int min_views = 2;          ///< that must see a piece of surface
  double hole_size = 12;      ///< extent of what is closed though nobody saw it, where it is surrounded by
                              ///< surface that was seen; lattice steps, 0 = nothing
  double smallest_part = 16;  ///< connected parts of less extent are left out; lattice steps
  int threads = 1;            ///< changes no result
};

struct Extraction {
  Surface surface;               ///< without normals and colours
  std::int64_t unsupported = 0;  ///< triangles left out: too few views
  std::int64_t debris = 0;       ///< triangles left out: part of something small
  std::int64_t closed = 0;       ///< triangles that close holes
};

/// One point for each cell of the lattice that the surface goes through. The same for any number of threads.
Extraction extract_surface(const DistanceField& field, const ExtractionOptions& options);

}  // namespace roxel

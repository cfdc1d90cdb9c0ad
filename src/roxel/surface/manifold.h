#pragma once
/// Surfaces whose every edge has at most two triangles, and whose every point has one fan of them: what other
/// programs (printing, simulation, remeshing) expect.

#include "roxel/surface/surface.h"

namespace roxel {

struct ManifoldSurface {
  Surface surface;
  std::int64_t dropped = 0;  ///< triangles
  std::int64_t cut = 0;      ///< points that became several
};

/// Without triangles that have no area in their topology (a corner twice), that are there twice, or twice
/// back to back. Where sheets touch in an edge or a point, they are cut apart [Gueziec01]: each gets points
/// of its own, a hundredth of the way to the middle of their neighbours from where they were. Sheets around
/// an edge are paired so that the inside lies between them. Where cutting does not do, the smallest triangles
/// go. Other points keep their places and order; new ones come last. Attributes follow.
ManifoldSurface made_manifold(const Surface& surface);

/// Whether every edge has at most one triangle on either side, these oriented alike, and every point one fan.
bool is_manifold(const Mesh& mesh);

}  // namespace roxel

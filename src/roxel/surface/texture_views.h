#pragma once
/// What each view shows of each triangle of a surface: the ground on which texturing chooses
/// (docs/surface.md).

#include <functional>

#include "roxel/base/run_context.h"
#include "roxel/camera/camera.h"
#include "roxel/image/image.h"
#include "roxel/surface/mesh_rays.h"
#include "roxel/surface/surface.h"

namespace roxel {

using Rgb = std::array<float, 3>;

/// A photograph as texture; pixels of one size.
struct TextureView {
  PinholeCamera camera;
  Image rgb;         ///< linear, 1 = white
  Mask usable = {};  ///< 0 where the object is not shown; empty = everywhere
};

/// The view of that number; called several times for every view, from any thread.
using TextureViewLoader = std::function<TextureView(int view_idx)>;

/// One view of one triangle.
struct FaceView {
  int view = 0;
  float quality = 0;  ///< pixels that it covers there
  Rgb color{};        ///< mean, linear
  float detail = 0;   ///< mean change of display values from pixel to pixel
};

struct SightOptions {
  double tolerance = 0;       ///< what is less than that in front of a triangle does not hide it, world units
  double least_cosine = 0.1;  ///< of the angle between line of sight and normal
  int views_held = 1;         ///< at once; changes no result
};

/// For every triangle the views that see all of it, ascending.
std::vector<std::vector<FaceView>> face_views(const Mesh& mesh, const MeshRays& rays, int view_count,
                                              const TextureViewLoader& load, const SightOptions& options,
                                              RunContext& context);

/// Colours of the surface's points as the photographs show them: mean over the views that see them, weighted
/// by the square of the cosine; `fallback` (one a point) where none does. Each view's light is multiplied by
/// its gain.
std::vector<Rgb> photograph_colors(const Surface& surface, const MeshRays& rays, int view_count,
                                   const TextureViewLoader& load, const std::vector<Rgb>& gains,
                                   const std::vector<Rgb>& fallback, const SightOptions& options,
                                   RunContext& context);

/// What each view's light must be multiplied by, a channel, to show the surface as the points' colours do:
/// the median over triangles. 1 where a view shows fewer than 20 triangles.
std::vector<Rgb> light_gains(const Surface& surface, const std::vector<std::vector<FaceView>>& views,
                             int view_count);

/// Between the four pixels around pixel position (u, v); clamped to the image.
Rgb bilinear(const Image& image, double u, double v);

}  // namespace roxel

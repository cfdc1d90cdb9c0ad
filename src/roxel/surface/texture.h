#pragma once
/// One picture for a whole surface, made from photographs (docs/surface.md).

#include <optional>

#include "roxel/surface/view_choice.h"

namespace roxel {

struct TextureOptions {
  int largest_side = 8192;  ///< of the picture, pixels; charts are reduced until they fit
  bool match_light = true;  ///< brings each view's light to the colours of the surface's points
  bool level_seams = true;
  double sight_tolerance = 0;  ///< world units
  double seam_cost = 0.6;
  double transient = 0.12;
  int views_held = 1;  ///< at once; changes no result
};

struct TexturedSurface {
  Surface surface;
  Image picture;                     ///< 3 channels, display values in [0, 1]
  std::vector<Eigen::Vector2f> uvs;  ///< in [0, 1], (0, 0) is the top left corner of the picture
  std::vector<std::array<std::uint32_t, 3>> uv_corners;  ///< a triangle's indices into uvs
  std::int64_t charts = 0;
  std::int64_t unseen = 0;                 ///< triangles that no view sees whole: coloured by their points
  std::int64_t transients = 0;             ///< views of triangles that were left out
  double scale = 1;                        ///< of photographs' pixels in the picture
  std::vector<Rgb> gains;                  ///< of the views' light
  double seam_before = 0, seam_after = 0;  ///< RMS difference across seams, display values
};

/// The surface must have normals and colours. Views are loaded one at a time, four times each. The same for
/// any number of threads. Throws Cancelled.
TexturedSurface textured(Surface surface, int view_count, const TextureViewLoader& load,
                         const TextureOptions& options, RunContext& context);

/// The texture's colour where a ray hits; linear. `textured` must outlive it.
std::function<Rgb(const MeshHit&)> texture_colors(const TexturedSurface& textured);

}  // namespace roxel

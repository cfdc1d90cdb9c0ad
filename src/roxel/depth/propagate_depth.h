#pragma once
/// Belief propagation over one view's depth map: neighbours share what they know ([Jethwa04] section 6.3;
/// docs/depth.md).

#include <functional>
#include <optional>

#include "roxel/depth/depth_layers.h"
#include "roxel/depth/gaussian_lattice.h"
#include "roxel/depth/pixel_plane.h"

namespace roxel {

enum class DepthPrior {
  kEdgeAware,  ///< neighbours lie on one plane, unless their colours or depths say otherwise
  kPlain,      ///< neighbours are as deep as each other: [Jethwa04] eq. (6.8)
};

struct PropagateDepthOptions {
  DepthPrior prior = DepthPrior::kEdgeAware;
  std::optional<double> prior_sigma;  ///< deviation between neighbours, world units; none: from the data
  bool fill = false;                  ///< give depth to pixels without, see PropagationGuide::fillable
  PropagationOptions propagation;
};

/// Mean variance over the pixels that have depth before; world units squared.
struct PropagationFigures {
  std::int64_t pixels = 0;                         ///< with depth before
  std::int64_t filled = 0;                         ///< without
  double variance_before = 0, variance_after = 0;  ///< summed over `pixels`
  double prior_sigma = 0;                          ///< summed over views
  int views = 0;
  int sweeps = 0;       ///< the most of any view
  int converged = 0;    ///< views whose beliefs no longer move
  double movement = 0;  ///< the largest of a belief in a view's last sweep, in its deviations
  double seconds = 0;
  void add(const PropagationFigures& other);
};

/// What the prior is made from, beside the depth itself.
struct PropagationGuide {
  const Image& luma;  ///< matching_luma of the photograph
  double focal_px = 1;
  double voxel_size = 1;
  /// Not 0 where `fill` may give depth, such as what masks call foreground; empty: where rays are no less
  /// opaque than kEmptyRay.
  Image fillable = {};
};

/// Rays of less opacity end behind the volume.
inline constexpr float kEmptyRay = 0.05f;

/// Fills depth_bp and variance_bp. Pixels less opaque than one half count as without depth.
PropagationFigures propagate_depth(DepthLayers& layers, const PropagationGuide& guide,
                                   const PropagateDepthOptions& options, const std::function<void()>& stop);

/// Radius, in pixels, of the neighbourhood that planes are fitted to: the volume's depth is rough on the
/// scale of a voxel.
int plane_radius(const Image& depth, double focal_px, double voxel_size);

}  // namespace roxel

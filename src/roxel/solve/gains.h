#pragma once
/// One gain an image and channel, so that photographs without a usable sky come to one light: exposure, white
/// balance and the light's strength and tint together (docs/light.md).

#include <optional>

#include "roxel/march/render.h"
#include "roxel/solve/scene.h"
#include "roxel/volume/volume.h"

namespace roxel {

struct GainFit {
  std::vector<std::array<float, 3>> of_views;  ///< one a view
  int fitted_views = 0;       ///< the others show too little of the volume, and keep what they had
  double spread = 0;          ///< root mean square of the gains' logarithms, over views and channels
  double largest_change = 0;  ///< of any view and channel, as a ratio less 1
};

/// What fixes the gains' common scale.
enum class GainScale {
  kOfViews,   ///< all views' gains, or the light of those that have a dome's
  kOfVolume,  ///< the volume's colours as they are
};

/// What lies between a photograph and how the volume renders it: per channel the robust (Huber) mean of
/// log(photograph / rendering), over blocks of factor x factor photographed pixels that the volume covers and
/// that are neither masked, clipped nor dark; nothing where there are fewer than 32. The rendering has one
/// pixel a block, its `rgb` and `opacity` over the box alone; `exposure` is the radiance of display white.
std::optional<std::array<double, 3>> log_gain(const Photograph& photo, const Rendering& rendering, int factor,
                                              double exposure);

/// Gains that bring the volume's colours nearest to the photographs, by log_gain at about 96 pixels along
/// the longer side. Their geometric mean over the views is 1 in every channel; where some views have the
/// light of their dome, these keep it, and the others' gains are held to its scale: what lies between
/// log_gain and that light, in the mean over the views that have it, is taken off; and views under one sky,
/// though its light is not known, share the robust mean of their gains. `volume` holds canonical colours.
/// Every image is read once.
GainFit fit_gains(const Volume& volume, const Dataset& dataset, const PhotographLoader& load,
                  const Scene& scene, const RunContext& context, GainScale held_to = GainScale::kOfViews);

}  // namespace roxel

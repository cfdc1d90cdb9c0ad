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

/// A photograph in squares of pixels, of which each has the mean radiance of all its pixels; those that hold
/// a pixel that is masked, unusable or clipped do not count.
struct PhotographSquares {
  int side = 1;  ///< photographed pixels along a square
  Image rgb;     ///< 3 channels
  Mask counted;  ///< 255 or 0
};
/// `exposure` is the radiance of display white: 1 for photographs that clip there.
PhotographSquares squares_of(const Photograph& photo, int side, double exposure);

/// Every view's photograph at about 96 squares along the longer side, read when first asked for.
class SmallPhotographs {
 public:
  SmallPhotographs(const Dataset& dataset, const PhotographLoader& load)
      : dataset_(dataset), load_(load), of_views_(dataset.views.size()) {}
  /// May be called for several views at once.
  const PhotographSquares& operator()(int view_idx, double exposure);
  const Dataset& dataset() const { return dataset_; }
  /// Of all of a data set's.
  static double bytes(const Dataset& dataset);
  /// They are read again when next asked for: their masks are others.
  void forget() { of_views_.assign(of_views_.size(), std::nullopt); }

 private:
  const Dataset& dataset_;
  const PhotographLoader& load_;
  std::vector<std::optional<PhotographSquares>> of_views_;
};

/// What lies between a photograph and how the volume renders it: per channel the robust (Huber) mean of
/// log(photograph / rendering), over squares that count, that the volume covers and that are not dark;
/// nothing where there are fewer than 32. The rendering has one pixel a square, its `rgb` and `opacity` over
/// the box alone.
std::optional<std::array<double, 3>> log_gain(const PhotographSquares& photo, const Rendering& rendering,
                                              double exposure);

/// Gains that bring the volume's colours nearest to the photographs, by log_gain. Their geometric mean over
/// the views is 1 in every channel; where some views have the light of their dome, these keep it, and the
/// others' gains are held to its scale: what lies between log_gain and that light, in the mean over the views
/// that have it, is taken off; and views under one sky, though its light is not known, share the robust mean
/// of their gains. `volume` holds canonical colours.
GainFit fit_gains(const Volume& volume, SmallPhotographs& photographs, const Scene& scene,
                  const RunContext& context, GainScale held_to = GainScale::kOfViews);

}  // namespace roxel

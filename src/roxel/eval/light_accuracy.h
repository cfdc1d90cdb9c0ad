#pragma once
/// How far the colour of one place still differs between capture nodes once light is divided out, and how
/// far it is from the place's albedo (docs/evaluation.md).

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "roxel/camera/camera.h"
#include "roxel/eval/color_accuracy.h"
#include "roxel/image/image.h"

namespace roxel {

/// A photograph whose true depth is known.
struct DepthView {
  PinholeCamera camera;
  int node = 0;  ///< capture node
  Image depth;   ///< true distance along the optical axis; 0 = no surface
};

/// One place as one view shows it.
struct PlaceSighting {
  int view = 0;  ///< index into the views
  int x = 0, y = 0;
};

struct SharedPlace {
  Eigen::Vector3d x;
  std::vector<PlaceSighting> sightings;  ///< in the order of the views
};

struct SharedPlaceOptions {
  int least_nodes = 3;
  int stride = 8;           ///< pixels between the pixels whose places are looked up
  double tolerance = 0.01;  ///< relative difference of depths that are of one surface
};

/// Places on the true surface that so many nodes see: those of every stride-th pixel, inner pixels alone, so
/// that the 3 x 3 pixels around every sighting are of the same surface. Each view's own, in order.
std::vector<SharedPlace> shared_places(std::span<const DepthView> views, const SharedPlaceOptions& options,
                                       int threads);

/// Mean of the 3 x 3 pixels around a sighting; none where one is not above 0.
std::optional<Eigen::Vector3d> mean_color(const Image& rgb, const PlaceSighting& sighting);

/// Colour of a place in a sighting of it.
using PlaceColor = std::function<std::optional<Eigen::Vector3d>(std::size_t place, std::size_t sighting)>;

struct ColorSpread {
  std::int64_t places = 0;
  double mean = 0, median = 0;  ///< of the places' standard deviations
};

/// Per place the standard deviation over nodes (n - 1) of log colour, a node's being the mean over its
/// sightings; root mean square over channels. Places with fewer than `least_nodes` coloured nodes are left
/// out.
ColorSpread color_spread(std::span<const DepthView> views, const std::vector<SharedPlace>& places,
                         const PlaceColor& color, int least_nodes);

struct LogError {
  std::int64_t pixels = 0;
  double mean = 0, median = 0;
};

/// Per pair the root mean square over channels of log(estimate / truth), less its mean over all pairs and
/// channels: one scale is free. Pairs with a channel that is not above 0 are left out.
LogError log_error(const std::vector<ColorPair>& pairs);

}  // namespace roxel

#pragma once
/// The part of the world worth reconstructing: a box, how far rays go on behind it, and the depths between
/// which each view looks. Chosen from, in this order: the caller's box, the data set's own, its sparse
/// points, the cameras alone. World units; depths run along the optical axis.

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "roxel/dataset/dataset.h"

namespace roxel {

struct BoundsOptions {
  std::optional<double> near;              ///< for every view; > 0
  std::optional<double> far;               ///< for every view; > near
  std::optional<Eigen::AlignedBox3d> box;  ///< taken as it is
  bool use_scene_bounds = true;            ///< the data set's own box, where it states one
  bool use_points = true;                  ///< its sparse points, where it has enough of them
  /// Where set, and the data set has masks, a box from points or cameras is tightened by them; a box from
  /// cameras then starts larger, since the masks say where the object ends.
  PhotographLoader load_masks;
};

struct DepthRange {
  double near = 0;  ///< nothing nearer is looked for; > 0
  double far = 0;   ///< rays end here; > near
};

struct SceneBounds {
  Eigen::AlignedBox3d box;
  double far = 0;                 ///< the largest far of all views: the surround reaches out to it
  std::vector<DepthRange> views;  ///< one a view of the data set
  std::string how;                ///< one sentence for people: what the box was chosen from
};

/// Needs nodes (assign_nodes). Throws InvalidInput where the options contradict themselves, and where
/// nothing tells how large the scene is (one optical centre, no points, no box).
SceneBounds default_bounds(const Dataset& dataset, const BoundsOptions& options = {});

/// The box that contains what is foreground in the masks (visual hull on a coarse grid): a cell stays when
/// enough nodes see it and hardly a masked view of those sees background there. Loads each view
/// that has a mask file or alpha once (at most 120 of them, evenly chosen). Returns `box` unchanged where no
/// view has a foreground mask or the hull is empty; never larger than `box`.
Eigen::AlignedBox3d tighten_by_masks(const Eigen::AlignedBox3d& box, const Dataset& dataset,
                                     const PhotographLoader& load);

}  // namespace roxel

#pragma once
/// The box worth reconstructing as the cameras alone tell it. Three layouts of cameras are told apart:
/// outside-in (they look at one place: turntables, rings, domes, facades from an arc), forward (nearly
/// parallel axes: aerial nadir, a walk along a wall) and inside-out (they look away from each other: panorama
/// nodes).

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "roxel/dataset/dataset.h"

namespace roxel {

enum class CameraLayout { kOutsideIn, kForward, kInsideOut };

struct CameraRig {
  CameraLayout layout = CameraLayout::kOutsideIn;
  Eigen::Vector3d focus;   ///< the point nearest to all optical axes; the mean centre where that is ill-posed
  double focus_depth = 0;  ///< median depth of the focus over the views in front of it; 0 unless outside-in
  double node_spacing = 0;  ///< median distance of a node to its nearest neighbour, at different places
  double extent = 0;        ///< largest distance between two nodes
};

/// Needs nodes. With one optical centre the layout is inside-out, and spacing and extent are 0.
CameraRig describe_cameras(const Dataset& dataset);

/// Depths that a view is trusted to show something worth reconstructing at, where nothing else says so.
struct TrustedDepths {
  double near;
  double far;
};
TrustedDepths trusted_depths(const CameraRig& rig, const View& view);

/// Whether the view sees the point: inside its image, and between the two depths.
bool sees(const View& view, const Eigen::Vector3d& point, const TrustedDepths& depths);

/// The number of nodes of which at least one view sees each of the points.
std::vector<int> count_seeing_nodes(const Dataset& dataset, const CameraRig& rig,
                                    const std::vector<Eigen::Vector3d>& points);

/// How many nodes have to see a place for it to be worth reconstructing: three quarters of them for
/// outside-in (what most of them look at), half of them for inside-out, three for forward cameras; at least
/// two.
int seeing_quorum(const Dataset& dataset, const CameraRig& rig);

/// The box around every place that at least `quorum` nodes see. Empty where there is none.
Eigen::AlignedBox3d box_seen_by(const Dataset& dataset, const CameraRig& rig, int quorum);

}  // namespace roxel

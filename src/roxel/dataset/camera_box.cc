#include "roxel/dataset/camera_box.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "roxel/dataset/cell_grid.h"

namespace roxel {
namespace {

/// Axes whose spread about their mean direction is below this cannot fix the depth of a focus.
constexpr double kLeastAxisSpreadRad = 4.0 * M_PI / 180.0;
/// Share of the views that must see the focus for the cameras to count as looking at one place.
constexpr double kFocusQuorum = 0.7;
/// A dome or a mixed set of photographs rarely shows all of the object in more than half of its views: at
/// three quarters the boxes of real sets cut into it.
constexpr double kOutsideInQuorum = 0.5;
/// Depth trusted before and behind the focus, in half widths of what a view sees there.
constexpr double kOutsideInReach = 1.25;
constexpr double kInsideOutQuorum = 0.5;
constexpr int kForwardQuorum = 3;
constexpr int kGridCells = 40;  // along each side
constexpr int kRefinements = 2;

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

Eigen::Vector3d optical_axis(const View& view) { return view.camera.pose.rotation.row(2).transpose(); }

/// Minimises the sum of squared distances to all optical axes; empty where they are too parallel.
std::optional<Eigen::Vector3d> nearest_point_to_axes(const std::vector<View>& views) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const View& view : views) {
    const Eigen::Vector3d d = optical_axis(view);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    a += across;
    b += across * view.camera.pose.centre;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(a / static_cast<double>(views.size()));
  const double least_spread = std::sin(kLeastAxisSpreadRad);
  if (solver.eigenvalues()[0] < least_spread * least_spread) return std::nullopt;
  return a.ldlt().solve(b);
}

bool inside_image(const View& view, const Eigen::Vector3d& pixel) {
  const Intrinsics& k = view.camera.intrinsics;
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= k.width && pixel.y() <= k.height;
}

void measure_baselines(const std::vector<Node>& nodes, CameraRig& rig) {
  std::vector<double> nearest(nodes.size(), std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (std::size_t j = i + 1; j < nodes.size(); ++j) {
      const double apart = (nodes[i].centre - nodes[j].centre).norm();
      rig.extent = std::max(rig.extent, apart);
      if (apart == 0) continue;
      nearest[i] = std::min(nearest[i], apart);
      nearest[j] = std::min(nearest[j], apart);
    }
  }
  std::erase_if(nearest, [](double d) { return std::isinf(d); });
  rig.node_spacing = median(nearest);
}

/// What share of a view's shorter side a thing at `depth` moves by from a node to its neighbour.
double depth_of_shift(const CameraRig& rig, const View& view, double share) {
  const Intrinsics& k = view.camera.intrinsics;
  return rig.node_spacing * k.fx / (share * std::min(k.width, k.height));
}

double half_diagonal_tangent(const View& view) {
  const Intrinsics& k = view.camera.intrinsics;
  return 0.5 * std::hypot(k.width / k.fx, k.height / k.fy);
}

double half_side_tangent(const View& view) {
  const Intrinsics& k = view.camera.intrinsics;
  return 0.5 * std::max(k.width / k.fx, k.height / k.fy);
}

Eigen::AlignedBox3d cube(const Eigen::Vector3d& centre, double half) {
  return {centre.array() - half, centre.array() + half};
}

/// A region that surely holds the box.
Eigen::AlignedBox3d search_region(const Dataset& dataset, const CameraRig& rig) {
  if (rig.layout == CameraLayout::kOutsideIn) {
    std::vector<double> reach;
    for (const View& view : dataset.views) {
      reach.push_back(std::min(1.5, 2 * half_diagonal_tangent(view)) * rig.focus_depth);
    }
    return cube(rig.focus, median(reach));
  }
  Eigen::AlignedBox3d region;
  double farthest = 0;
  for (const View& view : dataset.views) {
    farthest = std::max(farthest, trusted_depths(rig, view).far);
    region.extend(view.camera.pose.centre);
  }
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(1.5 * farthest);
  return {region.min() - margin, region.max() + margin};
}

}  // namespace

CameraRig describe_cameras(const Dataset& dataset) {
  CameraRig rig;
  measure_baselines(dataset.nodes, rig);
  const std::optional<Eigen::Vector3d> focus = nearest_point_to_axes(dataset.views);
  rig.focus = Eigen::Vector3d::Zero();
  for (const Node& node : dataset.nodes) rig.focus += node.centre / static_cast<double>(dataset.nodes.size());
  if (!focus || rig.extent == 0) {
    rig.layout = rig.extent == 0 ? CameraLayout::kInsideOut : CameraLayout::kForward;
    return rig;
  }
  std::vector<double> depths;
  int seen = 0;
  for (const View& view : dataset.views) {
    const Eigen::Vector3d pixel = view.camera.project(*focus);
    if (pixel.z() <= 0) continue;
    depths.push_back(pixel.z());
    seen += inside_image(view, pixel);
  }
  const double views = static_cast<double>(dataset.views.size());
  if (seen >= kFocusQuorum * views) {
    rig.focus = *focus;
    rig.focus_depth = median(depths);
  } else {
    // Axes that spread and yet share no place in front of them: outwards from one region, or a fan.
    rig.layout = CameraLayout::kInsideOut;
  }
  return rig;
}

TrustedDepths trusted_depths(const CameraRig& rig, const View& view) {
  TrustedDepths depths{};
  switch (rig.layout) {
    case CameraLayout::kOutsideIn: {
      // About as deep as it is wide: how far the views overlap behind the focus says nothing about the scene.
      const double focus_depth =
          std::max(view.camera.camera_from_world(rig.focus).z(), 0.1 * rig.focus_depth);
      const double reach = kOutsideInReach * half_side_tangent(view) * focus_depth;
      depths = {std::max(focus_depth - reach, 0.1 * focus_depth), focus_depth + reach};
      break;
    }
    case CameraLayout::kForward:
      // Neighbouring pictures overlap by a tenth at the near depth, and parallax is worth little once it
      // falls to an eighth of the picture.
      depths = {depth_of_shift(rig, view, 0.9), depth_of_shift(rig, view, 0.125)};
      break;
    case CameraLayout::kInsideOut:
      depths = {0.1 * rig.node_spacing, 0.75 * rig.extent};
      break;
  }
  depths.near = view.near.value_or(depths.near);
  depths.far = view.far.value_or(std::max(depths.far, 1.5 * depths.near));
  return depths;
}

bool sees(const View& view, const Eigen::Vector3d& point, const TrustedDepths& depths) {
  const Eigen::Vector3d pixel = view.camera.project(point);
  return pixel.z() >= depths.near && pixel.z() <= depths.far && inside_image(view, pixel);
}

std::vector<int> count_seeing_nodes(const Dataset& dataset, const CameraRig& rig,
                                    const std::vector<Eigen::Vector3d>& points) {
  std::vector<int> counts(points.size(), 0);
  std::vector<TrustedDepths> depths;
  for (const View& view : dataset.views) depths.push_back(trusted_depths(rig, view));
  for (const Node& node : dataset.nodes) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      counts[i] += std::any_of(node.view_idxs.begin(), node.view_idxs.end(),
                               [&](int v) { return sees(dataset.views[v], points[i], depths[v]); });
    }
  }
  return counts;
}

int seeing_quorum(const Dataset& dataset, const CameraRig& rig) {
  const int nodes = static_cast<int>(dataset.nodes.size());
  switch (rig.layout) {
    case CameraLayout::kOutsideIn:
      return std::max(2, static_cast<int>(std::ceil(kOutsideInQuorum * nodes)));
    case CameraLayout::kInsideOut:
      return std::max(2, static_cast<int>(std::ceil(kInsideOutQuorum * nodes)));
    case CameraLayout::kForward:
      break;
  }
  return std::min(kForwardQuorum, nodes);
}

Eigen::AlignedBox3d box_seen_by(const Dataset& dataset, const CameraRig& rig, int quorum) {
  Eigen::AlignedBox3d region = search_region(dataset, rig);
  for (int round = 0; round <= kRefinements; ++round) {
    const CellGrid grid(region, kGridCells);
    const std::vector<int> counts = count_seeing_nodes(dataset, rig, grid.centres());
    const Eigen::AlignedBox3d kept = grid.bounds_of([&](std::size_t cell) { return counts[cell] >= quorum; });
    if (kept.isEmpty() || round == kRefinements) return kept;
    // One cell of margin: the next, finer grid may find more at the rim.
    region = {kept.min() - grid.cell_size(), kept.max() + grid.cell_size()};
  }
  return region;
}

}  // namespace roxel

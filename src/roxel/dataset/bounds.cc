#include "roxel/dataset/bounds.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "roxel/base/error.h"
#include "roxel/dataset/camera_box.h"

namespace roxel {
namespace {

constexpr std::size_t kFewestPoints = 20;
constexpr std::size_t kMostPoints = 20000;     // more of them tell a box little
constexpr std::size_t kMostVotingNodes = 300;  // nor do more nodes
constexpr int kTrustedTrack = 3;               // views that see a point before it is trusted
constexpr double kPointPercentile = 0.005;     // cut at both ends: outliers of structure from motion
constexpr double kPointMargin = 0.1;           // of the extent: what the percentiles and sparse sampling miss
constexpr double kMaskedQuorum = 0.25;         // share of the nodes that see what the masks then tighten
constexpr double kPointQuorum = 0.4;      // share of the nodes that look at what outside-in points may bound
constexpr double kNearShare = 0.5;        // of the depth at which the box, or what is known, begins
constexpr double kSurroundDiagonals = 3;  // how far rays go on behind the box
constexpr double kInsideNearDiagonals = 1e-3;

std::string describe(const std::string& prefix, std::size_t used, std::size_t all) {
  std::ostringstream out;
  out << prefix << " (" << used << " of " << all
      << " points, 0.5th to 99.5th percentile, a margin of a tenth)";
  return out.str();
}

double percentile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * (values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

void check_options(const BoundsOptions& options) {
  const auto text = [](double value) { return std::to_string(value); };
  if (options.near && !(*options.near > 0)) throw_invalid("near", text(*options.near), "more than 0");
  if (options.far && !(*options.far > options.near.value_or(0))) {
    throw_invalid("far", text(*options.far), "more than near, " + text(options.near.value_or(0)));
  }
  if (options.box && !(options.box->sizes().array() > 0).all()) {
    std::ostringstream found;
    found << options.box->min().transpose() << " .. " << options.box->max().transpose();
    throw_invalid("bounds", found.str(), "each minimum below its maximum");
  }
}

/// At most `most` of the elements, evenly chosen.
template <class T>
std::vector<T> thinned(const std::vector<T>& all, std::size_t most) {
  if (all.size() <= most) return all;
  std::vector<T> chosen;
  for (std::size_t i = 0; i < most; ++i) chosen.push_back(all[i * all.size() / most]);
  return chosen;
}

/// The nodes, or an even choice of them, with their views: what a box is voted by.
Dataset voting_part(const Dataset& dataset) {
  Dataset part;
  part.path = dataset.path;
  for (Node node : thinned(dataset.nodes, kMostVotingNodes)) {
    for (int& view_idx : node.view_idxs) {
      part.views.push_back(dataset.views[view_idx]);
      view_idx = static_cast<int>(part.views.size()) - 1;
    }
    part.nodes.push_back(std::move(node));
  }
  part.points = dataset.points;
  part.point_view_counts = dataset.point_view_counts;
  part.scene_bounds = dataset.scene_bounds;
  return part;
}

/// Points with long enough tracks, if they are still enough; otherwise all.
std::vector<Eigen::Vector3d> trusted_points(const Dataset& dataset) {
  if (dataset.point_view_counts.size() != dataset.points.size()) return thinned(dataset.points, kMostPoints);
  std::vector<Eigen::Vector3d> trusted;
  for (std::size_t i = 0; i < dataset.points.size(); ++i) {
    if (dataset.point_view_counts[i] >= kTrustedTrack) trusted.push_back(dataset.points[i]);
  }
  const bool enough = trusted.size() >= std::max(kFewestPoints, dataset.points.size() / 4);
  return thinned(enough ? trusted : dataset.points, kMostPoints);
}

/// Where the cameras look at one place, the points of the background do not count.
std::vector<Eigen::Vector3d> points_looked_at(const Dataset& dataset, const CameraRig& rig) {
  const std::vector<Eigen::Vector3d> points = trusted_points(dataset);
  if (rig.layout != CameraLayout::kOutsideIn) return points;
  const int quorum = std::max(2, static_cast<int>(std::ceil(kPointQuorum * dataset.nodes.size())));
  const std::vector<int> counts = count_seeing_nodes(dataset, rig, points);
  std::vector<Eigen::Vector3d> looked_at;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (counts[i] >= quorum) looked_at.push_back(points[i]);
  }
  return looked_at.size() >= std::max(kFewestPoints, points.size() / 10) ? looked_at : points;
}

Eigen::AlignedBox3d robust_box(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d low, high;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
    low[axis] = percentile(values, kPointPercentile);
    high[axis] = percentile(values, 1 - kPointPercentile);
  }
  // A flat cloud gets some thickness from its longest side.
  const Eigen::Vector3d extent = high - low;
  const Eigen::Vector3d margin = kPointMargin * extent.cwiseMax(0.1 * extent.maxCoeff());
  return {low - margin, high + margin};
}

bool has_masks(const Dataset& dataset) {
  return std::any_of(dataset.views.begin(), dataset.views.end(),
                     [](const View& v) { return !v.mask_path.empty() || v.has_alpha; });
}

void choose_box(const Dataset& dataset, const BoundsOptions& options, const CameraRig& rig,
                SceneBounds& bounds) {
  if (options.box) {
    bounds.box = *options.box;
    bounds.how = "as given";
    return;
  }
  if (options.use_scene_bounds && dataset.scene_bounds) {
    bounds.box = *dataset.scene_bounds;
    bounds.how = "scene_bounds of the data set";
    return;
  }
  if (options.use_points && dataset.points.size() >= kFewestPoints) {
    const std::vector<Eigen::Vector3d> points = points_looked_at(dataset, rig);
    bounds.box = robust_box(points);
    bounds.how = describe("sparse points", points.size(), dataset.points.size());
    if (bounds.box.volume() > 0) return;
  }
  if (rig.extent == 0) {
    throw_invalid(dataset.path + ": bounds", "no points and one optical centre for all views",
                  "bounds given by hand, sparse points, or views from several places");
  }
  int quorum = seeing_quorum(dataset, rig);
  if (rig.layout == CameraLayout::kOutsideIn && options.load_masks && has_masks(dataset)) {
    quorum = std::max(2, static_cast<int>(std::ceil(kMaskedQuorum * dataset.nodes.size())));
  }
  bounds.box = box_seen_by(dataset, rig, quorum);
  if (bounds.box.isEmpty()) bounds.box = box_seen_by(dataset, rig, quorum = 2);
  if (bounds.box.isEmpty()) {
    throw_invalid(dataset.path + ": bounds", "no place that two views see", "bounds given by hand");
  }
  constexpr const char* kLayouts[] = {"look at one place", "look in one direction", "look outwards"};
  bounds.how = std::string("cameras alone: they ") + kLayouts[static_cast<int>(rig.layout)] +
               "; what at least " + std::to_string(quorum) + " of " + std::to_string(dataset.nodes.size()) +
               " nodes see";
}

/// Smallest and largest depth of the box's corners.
DepthRange corner_depths(const PinholeCamera& camera, const Eigen::AlignedBox3d& box) {
  DepthRange range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (int corner = 0; corner < 8; ++corner) {
    const double depth =
        camera.camera_from_world(box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner))).z();
    range.near = std::min(range.near, depth);
    range.far = std::max(range.far, depth);
  }
  return range;
}

/// Depths of the 1st and 99th percentile of the points in the view, where there are enough.
std::optional<DepthRange> point_depths(const View& view, const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> depths;
  const TrustedDepths all{1e-12, std::numeric_limits<double>::infinity()};
  for (const Eigen::Vector3d& point : points) {
    if (sees(view, point, all)) depths.push_back(view.camera.camera_from_world(point).z());
  }
  if (depths.size() < kFewestPoints) return std::nullopt;
  return DepthRange{percentile(depths, kPointPercentile), percentile(depths, 1 - kPointPercentile)};
}

DepthRange view_range(const View& view, const SceneBounds& bounds, const CameraRig& rig,
                      const std::vector<Eigen::Vector3d>& points) {
  const double diagonal = bounds.box.diagonal().norm();
  const DepthRange corners = corner_depths(view.camera, bounds.box);
  const double least = rig.node_spacing > 0 ? std::min(0.1 * rig.node_spacing, 0.1 * diagonal)
                                            : kInsideNearDiagonals * diagonal;
  DepthRange range{std::max(kNearShare * corners.near, least),
                   std::max(corners.far, 0.0) + kSurroundDiagonals * diagonal};
  if (const std::optional<DepthRange> seen = point_depths(view, points)) {
    range.near = std::min(std::max(range.near, kNearShare * seen->near), seen->near);
    if (corners.near > 0) range.near = std::min(range.near, corners.near);
    range.far = std::max(range.far, 1.5 * seen->far);
  }
  return range;
}

void apply_given(const View& view, const BoundsOptions& options, DepthRange& range) {
  if (view.near) range.near = *view.near;
  if (view.far) range.far = *view.far;
  if (options.near) range.near = *options.near;
  if (options.far) range.far = *options.far;
  if (range.near < range.far) return;
  // One end was given and lies past the other's default: keep what was given.
  if (options.near || (view.near && !options.far)) {
    range.far = 2 * range.near;
  } else {
    range.near = 0.5 * range.far;
  }
}

}  // namespace

SceneBounds default_bounds(const Dataset& dataset, const BoundsOptions& options) {
  ROXEL_CHECK(!dataset.views.empty());
  ROXEL_CHECK(!dataset.nodes.empty());
  check_options(options);
  const CameraRig rig = describe_cameras(dataset);
  SceneBounds bounds;
  choose_box(voting_part(dataset), options, rig, bounds);
  const bool stated = options.box || (options.use_scene_bounds && dataset.scene_bounds);
  if (!stated && options.load_masks && has_masks(dataset)) {
    bounds.box = tighten_by_masks(bounds.box, dataset, options.load_masks);
    bounds.how += ", tightened by masks";
  }
  const std::vector<Eigen::Vector3d> points =
      options.use_points ? trusted_points(dataset) : std::vector<Eigen::Vector3d>();
  for (const View& view : dataset.views) {
    DepthRange range = view_range(view, bounds, rig, points);
    apply_given(view, options, range);
    bounds.far = std::max(bounds.far, range.far);
    bounds.views.push_back(range);
  }
  return bounds;
}

}  // namespace roxel

#pragma once
/// The calibrated photographs as the algorithms see them. Files are read by io; here pixels come from a
/// callback, undistorted and linear, one view at a time.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "roxel/camera/camera.h"
#include "roxel/camera/lens.h"
#include "roxel/image/image.h"

namespace roxel {

/// One photograph: where it was taken from and where its pixels are.
struct View {
  std::string name;            ///< the image's path relative to the data set's image root, without its suffix
  std::string image_path;      ///< absolute
  std::string mask_path;       ///< absolute; empty where there is no mask file
  bool has_alpha = false;      ///< the image file has an alpha channel, which may serve as its mask
  std::string source;          ///< for messages: "file:line" or "file: frames[3]" that this view comes from
  PinholeCamera camera;        ///< after undistortion; same size as the image file
  Lens lens;                   ///< of the image file, with the file's own intrinsics
  int node_idx = -1;           ///< capture node: index into Dataset::nodes; set by assign_nodes
  std::optional<int> node_id;  ///< `node` as given by the data set
  std::optional<double> time_utc_s;  ///< seconds since 1970-01-01T00:00:00Z
  std::optional<double> latitude_deg;
  std::optional<double> longitude_deg;
  std::optional<double> near;  ///< world units along the optical axis
  std::optional<double> far;
};

/// Views with one optical centre. Predictive agreement leaves a whole node out of what it is compared with.
struct Node {
  Eigen::Vector3d centre;
  std::vector<int> view_idxs;
};

struct Dataset {
  std::string path;
  std::string format;  ///< "colmap", "transforms", "middlebury", "strecha" or "krt"
  std::vector<View> views;
  std::vector<Node> nodes;
  std::vector<Eigen::Vector3d> points;              ///< sparse points, world; may be empty
  std::vector<int> point_view_counts;               ///< views that see each point; empty where unknown
  std::optional<Eigen::AlignedBox3d> scene_bounds;  ///< where the data set itself states them
  std::vector<std::string> warnings;                ///< what may spoil the result and what to do about it
  std::vector<std::string> notes;                   ///< what was chosen where the data set leaves a choice
};

/// A view's pixels after response, undistortion and masks.
struct Photograph {
  Image rgb;        ///< linear RGB, 3 channels
  Mask valid;       ///< 0 where undistortion left no data; empty = all valid
  Mask foreground;  ///< 255 object, 0 background; empty where the view has no mask
  Mask sky = {};    ///< 255 surely sky, 0 surely not; empty where the view's sky is not known
};

/// Throws InvalidInput when the file is missing, broken or of another size than the camera. Thread safe.
using PhotographLoader = std::function<Photograph(const View&)>;

/// Below this distance, in world units, two centres count as one place: a twentieth of the step between views
/// that are spread evenly as far as these typically are apart. A few that strayed far off do not change it
/// much.
double default_node_tolerance(const std::vector<View>& views);

/// Groups views into nodes: by node_id where given, otherwise by optical centres within `tolerance` (world
/// units; chains of close centres join), by default default_node_tolerance(). Fills nodes (given ids first,
/// ascending; then in the order of the views) and node_idx.
void assign_nodes(Dataset& dataset, std::optional<double> tolerance = std::nullopt);

}  // namespace roxel

#include "roxel/sky/sky_tasks.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "roxel/base/angles.h"
#include "roxel/base/error.h"
#include "roxel/base/formatted.h"
#include "roxel/base/median.h"
#include "roxel/dataset/scaled_photograph.h"

namespace roxel {
namespace {

constexpr double kSamePlace_deg = 0.01;  ///< a kilometre: what coordinates of one place may differ by
constexpr double kApart =
    10;  ///< two groups of cameras this many times as far apart as either is wide are two

/// The direction that cameras hold upright: cameras tilt, but they seldom roll, so it is the one that their
/// rows of pixels are most at right angles to.
Eigen::Vector3d camera_up(const std::vector<View>& views) {
  Eigen::Matrix3d rows = Eigen::Matrix3d::Zero();
  Eigen::Vector3d upright = Eigen::Vector3d::Zero();
  for (const View& view : views) {
    const Eigen::Vector3d row = view.camera.pose.rotation.row(0).transpose();
    rows += row * row.transpose();
    upright -= view.camera.pose.rotation.row(1).transpose();
  }
  if (!(upright.norm() > 0)) return Eigen::Vector3d::UnitZ();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(rows);
  // Views of one direction alone leave the angle open.
  const bool clear = axes.eigenvalues()[1] > 0.02 * static_cast<double>(views.size());
  const Eigen::Vector3d up =
      clear ? Eigen::Vector3d(axes.eigenvectors().col(0)) : Eigen::Vector3d(upright.normalized());
  return up.dot(upright) < 0 ? Eigen::Vector3d(-up) : up;
}

Eigen::Vector3d find_up(const Dataset& dataset, std::vector<std::string>& notes) {
  const bool placed = std::any_of(dataset.views.begin(), dataset.views.end(),
                                  [](const View& v) { return v.latitude_deg && v.longitude_deg; });
  const Eigen::Vector3d cameras = camera_up(dataset.views);
  if (placed || cameras.z() > 0.9) return Eigen::Vector3d::UnitZ();
  int axis = 0;
  cameras.cwiseAbs().maxCoeff(&axis);
  const bool near_axis = std::abs(cameras[axis]) > 0.9;
  const Eigen::Vector3d up =
      near_axis ? Eigen::Vector3d(Eigen::Vector3d::Unit(axis) * (cameras[axis] > 0 ? 1 : -1)) : cameras;
  notes.push_back(formatted("up is taken to be %.2f, %.2f, %.2f, which most cameras hold upright (--up)",
                            up.x(), up.y(), up.z()));
  return up;
}

std::string node_name(int number) { return formatted("n%02d", number); }

std::optional<double> first_value(const Dataset& dataset, const std::vector<int>& view_idxs,
                                  std::optional<double> View::*field) {
  for (const int v : view_idxs)
    if (dataset.views[v].*field) return dataset.views[v].*field;
  return std::nullopt;
}

void check_one_time(const Dataset& dataset, const Node& node) {
  const View* first = nullptr;
  for (const int v : node.view_idxs) {
    const View& view = dataset.views[v];
    if (!view.time_utc_s) continue;
    if (!first) first = &view;
    if (std::abs(*view.time_utc_s - *first->time_utc_s) > kSameSky_s)
      throw_invalid(view.source + ": node " + std::to_string(*view.node_id),
                    formatted("a time %.0f minutes from that of %s, which has the same node",
                              std::abs(*view.time_utc_s - *first->time_utc_s) / 60, first->source.c_str()),
                    "one time a node (two nodes of the same name?)");
  }
}

void check_one_place(const Dataset& dataset, const Node& node) {
  struct Coordinate {
    std::optional<double> View::*field;
    const char* name;
  };
  for (const Coordinate& c :
       {Coordinate{&View::latitude_deg, "latitude"}, {&View::longitude_deg, "longitude"}}) {
    const View* first = nullptr;
    for (const int v : node.view_idxs) {
      const View& view = dataset.views[v];
      if (!(view.*c.field)) continue;
      if (!first) first = &view;
      if (std::abs(std::remainder(*(view.*c.field) - *(first->*c.field), 360)) > kSamePlace_deg)
        throw_invalid(view.source + ": node " + std::to_string(*view.node_id),
                      formatted("a %s of %g, while %s, which has the same node, has %g", c.name,
                                *(view.*c.field), first->source.c_str(), *(first->*c.field)),
                      "one place a node (two nodes of the same name?)");
    }
  }
}

/// A node's views in two parts, on both sides of the widest gap between its cameras.
struct Halves {
  std::array<std::vector<int>, 2> view_idxs;
  double gap = 0;    ///< between the nearest cameras of the two
  double width = 0;  ///< of the wider one: the largest distance of its cameras from its first
  std::array<Eigen::Vector3d, 2> centres;
};

/// The longest link of the tree of shortest links between all cameras parts them.
Halves halves_of(const Dataset& dataset, const Node& node) {
  const std::size_t count = node.view_idxs.size();
  const auto centre = [&](std::size_t i) -> const Eigen::Vector3d& {
    return dataset.views[node.view_idxs[i]].camera.pose.centre;
  };
  std::vector<double> to_tree(count, std::numeric_limits<double>::infinity());
  std::vector<std::size_t> parent(count, 0), order{0};
  std::vector<char> in_tree(count, 0);
  in_tree[0] = 1;
  while (order.size() < count) {
    std::size_t nearest = count;
    for (std::size_t i = 0; i < count; ++i) {
      if (in_tree[i]) continue;
      const double apart = (centre(i) - centre(order.back())).norm();
      if (apart < to_tree[i]) to_tree[i] = apart, parent[i] = order.back();
      if (nearest == count || to_tree[i] < to_tree[nearest]) nearest = i;
    }
    in_tree[nearest] = 1;
    order.push_back(nearest);
  }
  std::size_t last = 0;
  for (std::size_t n = 1; n < count; ++n)
    if (last == 0 || to_tree[order[n]] > to_tree[order[last]]) last = n;
  Halves halves;
  std::vector<char> beyond(count, 0);
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t i = order[n];
    beyond[i] = n > 0 && (n == last || beyond[parent[i]]);
    halves.view_idxs[beyond[i]].push_back(node.view_idxs[i]);
  }
  halves.gap = last > 0 ? to_tree[order[last]] : 0;
  for (int h = 0; h < 2; ++h) {
    halves.centres[h] = Eigen::Vector3d::Zero();
    for (const int v : halves.view_idxs[h]) {
      const Eigen::Vector3d& x = dataset.views[v].camera.pose.centre;
      halves.centres[h] += x / static_cast<double>(halves.view_idxs[h].size());
      halves.width =
          std::max(halves.width, (x - dataset.views[halves.view_idxs[h].front()].camera.pose.centre).norm());
    }
  }
  return halves;
}

/// How far nodes typically are from their next, counting the two parts of one as two; 0: there is no other.
double node_spacing(const Dataset& dataset, const Node& node, const Halves& halves) {
  std::vector<Eigen::Vector3d> places(halves.centres.begin(), halves.centres.end());
  for (const Node& other : dataset.nodes)
    if (&other != &node) places.push_back(other.centre);
  if (places.size() < 3) return 0;
  std::vector<double> nearest(places.size(), std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < places.size(); ++i)
    for (std::size_t j = 0; j < places.size(); ++j)
      if (j != i) nearest[i] = std::min(nearest[i], (places[i] - places[j]).norm());
  return median(nearest);
}

/// A node's name may be a loose label; but cameras in two places, each small beside the gap between them, are
/// likely to be two nodes.
void check_one_centre(const Dataset& dataset, const Node& node, std::vector<std::string>& warnings) {
  if (node.view_idxs.size() < 2) return;
  const Halves halves = halves_of(dataset, node);
  const double spacing = node_spacing(dataset, node, halves);
  if (!(halves.gap > kApart * halves.width) || !(halves.gap > spacing / kApart)) return;
  const View& one = dataset.views[halves.view_idxs[0].front()];
  const View& other = dataset.views[halves.view_idxs[1].front()];
  const std::string where = other.source + ": node " + std::to_string(*other.node_id);
  const std::string found =
      formatted("a camera %.4g from that of %s, which has the same node", halves.gap, one.source.c_str());
  if (spacing > 0 && halves.gap > spacing)
    throw_invalid(where, found + formatted("; nodes are %.4g apart", spacing),
                  "one place a node (two nodes of the same name?)");
  warnings.push_back(where + ": " + found +
                     ": they are taken to be under one sky (two nodes of the same name?)");
}

/// Views of one place, apart by time; without times all together.
std::vector<std::vector<int>> split_by_time(const Dataset& dataset, const Node& node) {
  std::vector<int> views = node.view_idxs;
  const auto time = [&](int v) { return dataset.views[v].time_utc_s.value_or(0); };
  std::stable_sort(views.begin(), views.end(), [&](int a, int b) { return time(a) < time(b); });
  std::vector<std::vector<int>> groups;
  for (const int v : views) {
    if (groups.empty() || time(v) - time(groups.back().back()) > kSameSky_s) groups.emplace_back();
    groups.back().push_back(v);
  }
  for (auto& group : groups) std::sort(group.begin(), group.end());
  return groups;
}

/// Coordinates may differ by what those of one place differ by; where one view has none, it does not say
/// otherwise.
bool in_one_place(const View& one, const View& other) {
  const auto alike = [&](std::optional<double> View::*field) {
    return !(one.*field) || !(other.*field) ||
           std::abs(std::remainder(*(one.*field) - *(other.*field), 360)) <= kSamePlace_deg;
  };
  return alike(&View::latitude_deg) && alike(&View::longitude_deg);
}

struct Group {
  std::optional<int> id;
  std::vector<int> views;
};

std::vector<Group> group_views(const Dataset& dataset, std::vector<std::string>& warnings) {
  std::vector<Group> groups;
  std::multimap<double, std::size_t> by_time;  // of single views
  for (const Node& node : dataset.nodes) {
    const View& first = dataset.views[node.view_idxs.front()];
    if (first.node_id) {
      check_one_time(dataset, node);
      check_one_place(dataset, node);
      check_one_centre(dataset, node, warnings);
      groups.push_back({first.node_id, node.view_idxs});
      continue;
    }
    for (const std::vector<int>& views : split_by_time(dataset, node)) {
      const auto& time = dataset.views[views.front()].time_utc_s;
      if (views.size() == 1 && time) {
        const auto [begin, end] = by_time.equal_range(std::round(*time));
        const auto known = std::find_if(begin, end, [&](const auto& entry) {
          return in_one_place(dataset.views[groups[entry.second].views.front()],
                              dataset.views[views.front()]);
        });
        if (known != end) {
          groups[known->second].views.push_back(views.front());
          continue;
        }
        by_time.emplace(std::round(*time), groups.size());
      }
      groups.push_back({std::nullopt, views});
    }
  }
  return groups;
}

}  // namespace

DatasetSkies sky_tasks(const Dataset& dataset, const std::optional<std::array<double, 3>>& up) {
  DatasetSkies skies;
  const Eigen::Vector3d upwards =
      up ? Eigen::Vector3d(Eigen::Vector3d((*up)[0], (*up)[1], (*up)[2]).normalized())
         : find_up(dataset, skies.notes);
  const Eigen::Matrix3d sky_from_world =
      upwards == Eigen::Vector3d::UnitZ()
          ? Eigen::Matrix3d(Eigen::Matrix3d::Identity())
          : Eigen::Quaterniond::FromTwoVectors(upwards, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  int next = 0;
  std::vector<Group> groups = group_views(dataset, skies.warnings);
  for (const Group& group : groups) next = std::max(next, group.id.value_or(-1) + 1);
  for (Group& group : groups) {
    SkyTask task;
    task.name = node_name(group.id ? *group.id : next++);
    for (const int v : group.views) {
      task.views.push_back(dataset.views[v].name);
      task.centres.push_back(dataset.views[v].camera.pose.centre);
    }
    task.time_utc_s = first_value(dataset, group.views, &View::time_utc_s);
    task.latitude_deg = first_value(dataset, group.views, &View::latitude_deg);
    task.longitude_deg = first_value(dataset, group.views, &View::longitude_deg);
    task.sky_from_world = sky_from_world;
    skies.tasks.push_back(std::move(task));
    skies.view_idxs.push_back(std::move(group.views));
  }
  return skies;
}

int sky_scale(const PinholeCamera& camera) {
  constexpr double kFinest = 0.05 * kDegree;
  constexpr int kMost = 16;
  const double pixel = PixelRays(camera, Eigen::Matrix3d::Identity()).pixel_angle();
  return std::clamp(static_cast<int>(kFinest / pixel), 1, kMost);
}

int sky_workers(std::int64_t pixels, double most_bytes, int threads) {
  constexpr double kBytesOfPixel = 32;  // as read, undistorted and made smaller: measured with 24 megapixels
  return static_cast<int>(std::clamp(most_bytes / (kBytesOfPixel * static_cast<double>(pixels)), 1.0,
                                     static_cast<double>(threads)));
}

namespace {

/// Puts the brightest pixel of a square that clips in the place of its mean: means of what clips and what
/// does not are neither.
void keep_clipped(const Image& full, double clip, int scale, Image& small) {
  for (int v = 0; v < std::min(small.height() * scale, full.height()); ++v)
    for (int u = 0; u < std::min(small.width() * scale, full.width()); ++u) {
      const float *rgb = full.pixel(u, v), most = std::max({rgb[0], rgb[1], rgb[2]});
      float* const kept = small.pixel(u / scale, v / scale);
      if (most >= clip && most > std::max({kept[0], kept[1], kept[2]})) std::copy_n(rgb, 3, kept);
    }
}

}  // namespace

SkyPicture sky_picture(const View& view, Photograph photograph, const Eigen::Matrix3d& sky_from_world,
                       Mask known_sky) {
  const int scale = sky_scale(view.camera);
  const double clip = clip_level(photograph.rgb);
  if (scale > 1) {
    Photograph small = scaled(photograph, scale);
    keep_clipped(photograph.rgb, clip, scale, small.rgb);
    photograph = std::move(small);
    known_sky = scaled(known_sky, scale);
  }
  SkyPicture picture{std::move(photograph.rgb), std::move(photograph.valid), std::move(known_sky),
                     PixelRays(scaled(view.camera, scale), sky_from_world)};
  picture.clip = clip;
  picture.scale = scale;
  return picture;
}

}  // namespace roxel

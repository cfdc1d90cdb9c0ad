#include <algorithm>
#include <map>
#include <numeric>

#include "roxel/dataset/dataset.h"

namespace roxel {
namespace {

// With n views spread evenly along a line as long as they typically are apart, neighbours stand a step of
// spread / n apart, and any even layout in two or three dimensions has them farther apart. A twentieth of
// that step: neighbours on a straight path are forty times as far apart, on an orbit seventy, however many
// they are, while the centres that structure-from-motion finds for one panorama (its noise is taken as 1e-4
// of the scene's depth) join in sets of up to some five hundred views. Too small is the safer side: a chain
// of short steps would make a whole path one witness.
constexpr double kShareOfStep = 0.05;
// Of a view's distances to the others: one place may hold up to three quarters of all views, and up to a
// quarter of them may have strayed, before the step is theirs.
constexpr double kTypicalRank = 0.75;
constexpr std::size_t kMostRanked = 512;

double ranked(std::vector<double> values, double rank) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// How far views typically are apart: the median over views of a high rank of their distances to the others.
double typical_distance(const std::vector<View>& views) {
  const std::size_t stride = (views.size() - 1) / kMostRanked + 1;
  std::vector<double> of_views, distances;
  for (std::size_t i = 0; i < views.size(); i += stride) {
    distances.clear();
    for (std::size_t j = 0; j < views.size(); ++j)
      if (j != i) distances.push_back((views[i].camera.pose.centre - views[j].camera.pose.centre).norm());
    of_views.push_back(ranked(distances, kTypicalRank));
  }
  return ranked(std::move(of_views), 0.5);
}

/// Disjoint sets of indices; the smallest index of a set is its root.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }

  int root(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  void join(int i, int j) {
    const int a = root(i), b = root(j);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int> parent_;
};

/// Single linkage of the given views: sorted by x, a centre's neighbours are a short run of the order.
DisjointSets link_by_centre(const std::vector<View>& views, std::vector<int> view_idxs, double tolerance) {
  DisjointSets sets(views.size());
  const auto centre = [&](int i) -> const Eigen::Vector3d& { return views[i].camera.pose.centre; };
  std::sort(view_idxs.begin(), view_idxs.end(), [&](int a, int b) { return centre(a).x() < centre(b).x(); });
  for (std::size_t i = 0; i < view_idxs.size(); ++i) {
    for (std::size_t j = i + 1; j < view_idxs.size(); ++j) {
      const Eigen::Vector3d apart = centre(view_idxs[j]) - centre(view_idxs[i]);
      if (apart.x() > tolerance) break;
      if (apart.norm() <= tolerance) sets.join(view_idxs[i], view_idxs[j]);
    }
  }
  return sets;
}

Node make_node(const std::vector<View>& views, const std::vector<int>& view_idxs) {
  Node node{Eigen::Vector3d::Zero(), view_idxs};
  for (int view_idx : view_idxs) node.centre += views[view_idx].camera.pose.centre;
  node.centre /= static_cast<double>(view_idxs.size());
  return node;
}

}  // namespace

double default_node_tolerance(const std::vector<View>& views) {
  if (views.size() < 2) return 0;
  return kShareOfStep * typical_distance(views) / static_cast<double>(views.size());
}

void assign_nodes(Dataset& dataset, std::optional<double> given_tolerance) {
  std::vector<View>& views = dataset.views;
  const double tolerance = given_tolerance ? *given_tolerance : default_node_tolerance(views);

  std::map<int, std::vector<int>> by_id;
  std::vector<int> without_id;
  for (int i = 0; i < static_cast<int>(views.size()); ++i) {
    if (views[i].node_id) {
      by_id[*views[i].node_id].push_back(i);
    } else {
      without_id.push_back(i);
    }
  }
  DisjointSets sets = link_by_centre(views, without_id, tolerance);
  std::map<int, std::vector<int>> by_centre;
  for (int i : without_id) by_centre[sets.root(i)].push_back(i);

  dataset.nodes.clear();
  for (const auto& [id, view_idxs] : by_id) dataset.nodes.push_back(make_node(views, view_idxs));
  for (const auto& [root, view_idxs] : by_centre) dataset.nodes.push_back(make_node(views, view_idxs));
  for (int n = 0; n < static_cast<int>(dataset.nodes.size()); ++n) {
    for (int view_idx : dataset.nodes[n].view_idxs) views[view_idx].node_idx = n;
  }
}

}  // namespace roxel

#include <algorithm>
#include <map>
#include <numeric>

#include "roxel/dataset/dataset.h"

namespace roxel {
namespace {

constexpr double kDefaultRelativeTolerance = 1e-6;

double largest_centre_distance(const std::vector<View>& views) {
  double largest = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t j = i + 1; j < views.size(); ++j) {
      largest = std::max(largest, (views[i].camera.pose.centre - views[j].camera.pose.centre).squaredNorm());
    }
  }
  return std::sqrt(largest);
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

void assign_nodes(Dataset& dataset, double tolerance) {
  std::vector<View>& views = dataset.views;
  if (tolerance < 0) tolerance = kDefaultRelativeTolerance * largest_centre_distance(views);

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

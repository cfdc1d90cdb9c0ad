#include "roxel/surface/surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using Eigen::Vector3d;

double angle_between(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

/// Sets of points that are joined one after the other, each known by its first point.
class PointSets {
 public:
  explicit PointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

template <class T>
void append_one(const std::vector<T>& from, std::uint32_t i, std::vector<T>& to) {
  if (!from.empty()) to.push_back(from[i]);
}

}  // namespace

std::vector<Eigen::Vector3f> point_normals(const Mesh& mesh) {
  std::vector<Vector3d> sums(mesh.points.size(), Vector3d::Zero());
  for (const auto& triangle : mesh.triangles) {
    const Vector3d corner[3] = {mesh.points[triangle[0]], mesh.points[triangle[1]], mesh.points[triangle[2]]};
    const Vector3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    const double length = normal.norm();
    if (!(length > 0)) continue;
    for (int k = 0; k < 3; ++k) {
      const Vector3d to_next = corner[(k + 1) % 3] - corner[k], to_last = corner[(k + 2) % 3] - corner[k];
      sums[triangle[k]] += angle_between(to_next, to_last) / length * normal;
    }
  }
  std::vector<Eigen::Vector3f> normals(sums.size(), Eigen::Vector3f::Zero());
  for (std::size_t i = 0; i < sums.size(); ++i)
    if (sums[i].norm() > 1e-12) normals[i] = sums[i].normalized().cast<float>();
  return normals;
}

Surface kept_triangles(const Surface& surface, const std::vector<std::uint8_t>& keep) {
  const Mesh& mesh = surface.mesh;
  ROXEL_CHECK_EQ(keep.size(), mesh.triangles.size());
  std::vector<std::uint8_t> used(mesh.points.size());
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (keep[t])
      for (const std::uint32_t corner : mesh.triangles[t]) used[corner] = 1;
  Surface kept;
  std::vector<std::uint32_t> renamed(mesh.points.size());
  for (std::uint32_t i = 0; i < mesh.points.size(); ++i) {
    if (!used[i]) continue;
    renamed[i] = static_cast<std::uint32_t>(kept.mesh.points.size());
    kept.mesh.points.push_back(mesh.points[i]);
    append_one(surface.normals, i, kept.normals);
    append_one(surface.colors, i, kept.colors);
  }
  for (std::size_t t = 0; t < keep.size(); ++t) {
    if (!keep[t]) continue;
    const auto& [a, b, c] = mesh.triangles[t];
    kept.mesh.triangles.push_back({renamed[a], renamed[b], renamed[c]});
  }
  return kept;
}

FaceNeighbours face_neighbours(const Mesh& mesh) {
  struct Side {
    std::uint32_t high;
    std::int32_t face, edge;
  };
  // By their lower corner, of which each has few: by counting.
  std::vector<std::uint32_t> first(mesh.points.size() + 1);
  const auto for_each_side = [&](const auto& visit) {
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
      for (int k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax(mesh.triangles[f][k], mesh.triangles[f][(k + 1) % 3]);
        visit(low, Side{high, static_cast<std::int32_t>(f), k});
      }
  };
  for_each_side([&](std::uint32_t low, const Side&) { ++first[low + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<Side> sides(3 * mesh.triangles.size());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for_each_side([&](std::uint32_t low, const Side& side) { sides[next[low]++] = side; });
  FaceNeighbours neighbours(mesh.triangles.size(), {-1, -1, -1});
  for (std::size_t low = 0; low < mesh.points.size(); ++low) {
    const std::span of_low(sides.begin() + first[low], sides.begin() + first[low + 1]);
    std::stable_sort(of_low.begin(), of_low.end(),
                     [](const Side& a, const Side& b) { return a.high < b.high; });
    for (std::size_t i = 0; i + 1 < of_low.size(); ++i) {
      const Side &a = of_low[i], &b = of_low[i + 1];
      if (a.high != b.high || a.face == b.face) continue;
      neighbours[a.face][a.edge] = b.face;
      neighbours[b.face][b.edge] = a.face;
      ++i;
    }
  }
  return neighbours;
}

Components connected_components(const Mesh& mesh, const std::vector<std::uint8_t>& among) {
  PointSets sets(mesh.points.size());
  const auto counts = [&](std::size_t t) { return among.empty() || among[t]; };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (counts(t))
      for (int k = 1; k < 3; ++k) sets.join(mesh.triangles[t][0], mesh.triangles[t][k]);
  Components components;
  components.of_triangle.assign(mesh.triangles.size(), kNoComponent);
  std::vector<std::uint32_t> number(mesh.points.size(), kNoComponent);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!counts(t)) continue;
    std::uint32_t& own = number[sets.find(mesh.triangles[t][0])];
    if (own == kNoComponent) own = components.count++;
    components.of_triangle[t] = own;
  }
  return components;
}

}  // namespace roxel

#include "roxel/surface/mesh.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <unordered_set>

#include "roxel/base/error.h"

namespace roxel {
namespace {

/// Draws that may miss the box for each point that is wanted, before it is taken to be hardly touched.
constexpr std::int64_t kMostDraws = 200;

using Corners = std::array<Eigen::Vector3d, 3>;

Corners corners(const Mesh& mesh, std::size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  return {mesh.points[a], mesh.points[b], mesh.points[c]};
}

double area(const Corners& t) { return 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm(); }

Eigen::AlignedBox3d box_of(const Corners& t) {
  Eigen::AlignedBox3d box(t[0]);
  return box.extend(t[1]).extend(t[2]);
}

/// In [0, 1), the same on every machine (the standard's distributions are not).
double uniform(std::mt19937_64& rng) { return static_cast<double>(rng() >> 11) * 0x1p-53; }

/// Uniform over the triangle: [Turk90] folds a square along its diagonal.
Eigen::Vector3d point_on(const Corners& t, double u, double v) {
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  return t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
}

struct CellHash {
  std::size_t operator()(const std::array<std::int64_t, 3>& cell) const {
    std::uint64_t hash = 0;
    for (const std::int64_t i : cell) hash = (hash ^ static_cast<std::uint64_t>(i)) * 0x9e3779b97f4a7c15u;
    return hash ^ (hash >> 32);
  }
};

}  // namespace

double surface_area(const Mesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += area(corners(mesh, t));
  return sum;
}

std::vector<Eigen::Vector3d> sample_surface(const Mesh& mesh, const SurfaceSampling& options) {
  const bool everywhere = options.box.isEmpty();
  std::vector<std::size_t> triangles;
  std::vector<double> area_up_to;
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Corners corner = corners(mesh, t);
    if (!everywhere && !options.box.intersects(box_of(corner))) continue;
    if (!(area(corner) > 0)) continue;
    triangles.push_back(t);
    area_up_to.push_back(sum += area(corner));
  }
  std::vector<Eigen::Vector3d> samples;
  if (triangles.empty()) return samples;
  std::mt19937_64 rng(options.seed);
  for (std::int64_t draw = 0; draw < kMostDraws * options.count; ++draw) {
    if (static_cast<std::int64_t>(samples.size()) == options.count) break;
    const auto found = std::upper_bound(area_up_to.begin(), area_up_to.end(), uniform(rng) * sum);
    const std::size_t i = std::min<std::size_t>(found - area_up_to.begin(), triangles.size() - 1);
    const double u = uniform(rng), v = uniform(rng);
    const Eigen::Vector3d x = point_on(corners(mesh, triangles[i]), u, v);
    if (everywhere || options.box.contains(x)) samples.push_back(x);
  }
  return samples;
}

std::vector<Eigen::Vector3d> points_in_box(const std::vector<Eigen::Vector3d>& points,
                                           const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return points;
  std::vector<Eigen::Vector3d> inside;
  std::copy_if(points.begin(), points.end(), std::back_inserter(inside),
               [&](const Eigen::Vector3d& x) { return box.contains(x); });
  return inside;
}

std::vector<Eigen::Vector3d> one_point_a_cell(const std::vector<Eigen::Vector3d>& points, double cell_size) {
  ROXEL_CHECK(cell_size > 0);
  std::unordered_set<std::array<std::int64_t, 3>, CellHash> taken;
  std::vector<Eigen::Vector3d> kept;
  for (const Eigen::Vector3d& x : points) {
    std::array<std::int64_t, 3> cell;
    for (int axis = 0; axis < 3; ++axis)
      cell[axis] = static_cast<std::int64_t>(std::floor(x[axis] / cell_size));
    if (taken.insert(cell).second) kept.push_back(x);
  }
  return kept;
}

}  // namespace roxel

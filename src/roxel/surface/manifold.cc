#include "roxel/surface/manifold.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

namespace roxel {
namespace {

using Eigen::Vector3d;
using Triangle = std::array<std::uint32_t, 3>;

constexpr double kApart = 0.01;  ///< of the way to the middle of a point's neighbours

/// One side of a triangle: corner `side` to the one after it.
struct Side {
  std::uint32_t low, high;
  std::uint32_t triangle;
  std::uint8_t side;
  bool upwards;  ///< from low to high
};

bool same_edge(const Side& a, const Side& b) { return a.low == b.low && a.high == b.high; }

/// Sorted by edge, then by triangle.
std::vector<Side> sides_of(const Mesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::uint8_t k = 0; k < 3; ++k) {
      const std::uint32_t from = mesh.triangles[t][k], to = mesh.triangles[t][(k + 1) % 3];
      sides.push_back({std::min(from, to), std::max(from, to), t, k, from < to});
    }
  std::stable_sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.low != b.low ? a.low < b.low : a.high < b.high;
  });
  return sides;
}

/// Calls visit(begin, end) for the sides of one edge after the other.
template <class Visit>
void for_each_edge(const std::vector<Side>& sides, const Visit& visit) {
  for (std::size_t begin = 0; begin < sides.size();) {
    std::size_t end = begin + 1;
    while (end < sides.size() && same_edge(sides[begin], sides[end])) ++end;
    visit(begin, end);
    begin = end;
  }
}

/// Which triangles are neither degenerate nor there twice. Of those that lie back to back both go.
std::vector<std::uint8_t> single_triangles(const Mesh& mesh) {
  struct Entry {
    Triangle corners;  ///< ascending
    std::uint32_t triangle;
    bool turned;
  };
  std::vector<Entry> entries;
  std::vector<std::uint8_t> keep(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    auto [a, b, c] = mesh.triangles[t];
    if (a == b || b == c || c == a) continue;
    Entry entry{{a, b, c}, t, false};
    std::sort(entry.corners.begin(), entry.corners.end());
    const auto first = std::min_element(mesh.triangles[t].begin(), mesh.triangles[t].end());
    entry.turned = mesh.triangles[t][(first - mesh.triangles[t].begin() + 1) % 3] != entry.corners[1];
    entries.push_back(entry);
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.corners < b.corners; });
  for (std::size_t begin = 0; begin < entries.size();) {
    std::size_t end = begin;
    int balance = 0;
    for (; end < entries.size() && entries[end].corners == entries[begin].corners; ++end)
      balance += entries[end].turned ? -1 : 1;
    for (std::size_t i = begin; i < end && balance != 0; ++i)
      if (entries[i].turned == (balance < 0)) {
        keep[entries[i].triangle] = 1;
        break;
      }
    begin = end;
  }
  return keep;
}

/// TriangleFans of triangles, in sets that are one point each.
class TriangleFans {
 public:
  explicit TriangleFans(const Mesh& mesh) : mesh_(mesh), parent_(3 * mesh.triangles.size()) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  std::uint32_t find(std::uint32_t corner) {
    while (parent_[corner] != corner) corner = parent_[corner] = parent_[parent_[corner]];
    return corner;
  }
  /// Both ends of an edge are one point each for the two triangles.
  void join(const Side& a, const Side& b) {
    join(corner_at(a, a.low), corner_at(b, b.low));
    join(corner_at(a, a.high), corner_at(b, b.high));
  }

 private:
  std::uint32_t corner_at(const Side& side, std::uint32_t point) const {
    const std::uint32_t k =
        mesh_.triangles[side.triangle][side.side] == point ? side.side : (side.side + 1) % 3;
    return 3 * side.triangle + k;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

  const Mesh& mesh_;
  std::vector<std::uint32_t> parent_;
};

/// The way from an edge to the third corner of a triangle, as an angle around the edge.
double angle_around(const Mesh& mesh, const Side& side, const Vector3d& right, const Vector3d& up) {
  const std::uint32_t third = mesh.triangles[side.triangle][(side.side + 2) % 3];
  const Vector3d way = mesh.points[third] - mesh.points[side.low];
  return std::atan2(way.dot(up), way.dot(right));
}

/// Joins the triangles around an edge in pairs that have the inside between them.
void pair_sides(const Mesh& mesh, const Side* begin, const Side* end, TriangleFans& corners) {
  if (end - begin == 2 && begin[0].upwards != begin[1].upwards) return corners.join(begin[0], begin[1]);
  if (end - begin <= 2) return;
  const Vector3d along = mesh.points[begin->high] - mesh.points[begin->low];
  if (!(along.norm() > 0)) return;
  const Vector3d right = along.unitOrthogonal(), up = along.normalized().cross(right);
  std::vector<std::pair<double, const Side*>> around;
  for (const Side* side = begin; side < end; ++side)
    around.emplace_back(angle_around(mesh, *side, right, up), side);
  std::stable_sort(around.begin(), around.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  // A triangle that runs up the edge has its outside where angles are larger, one that runs down has the
  // inside there.
  for (std::size_t i = 0; i < around.size(); ++i) {
    const Side &first = *around[i].second, &next = *around[(i + 1) % around.size()].second;
    if (!first.upwards && next.upwards) corners.join(first, next);
  }
}

/// Gives each set of corners a point of its own. Returns how many points became several.
std::int64_t split_points(Surface& surface, TriangleFans& corners) {
  Mesh& mesh = surface.mesh;
  const std::size_t before = mesh.points.size();
  constexpr std::uint32_t kNone = 0xffffffffu;
  std::vector<std::uint32_t> first_set(before, kNone);
  std::map<std::uint32_t, std::uint32_t> point_of_set;  ///< of others than a point's first
  std::vector<std::uint32_t> point_of(3 * mesh.triangles.size());
  std::vector<std::uint8_t> is_cut(before);
  std::int64_t cut = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t point = mesh.triangles[t][k], set = corners.find(3 * t + k);
      if (first_set[point] == kNone) first_set[point] = set;
      if (first_set[point] == set) {
        point_of[3 * t + k] = point;
        continue;
      }
      const auto [own, is_new] =
          point_of_set.try_emplace(set, static_cast<std::uint32_t>(mesh.points.size()));
      point_of[3 * t + k] = own->second;
      if (!is_new) continue;
      mesh.points.push_back(Vector3d(mesh.points[point]));
      if (!surface.normals.empty()) surface.normals.push_back(Eigen::Vector3f(surface.normals[point]));
      if (!surface.colors.empty()) surface.colors.push_back(std::array<float, 3>(surface.colors[point]));
      cut += !is_cut[point];
      is_cut[point] = 1;
    }
  if (cut == 0) return 0;
  const std::vector<Triangle> old = mesh.triangles;
  const std::vector<Vector3d> places = mesh.points;
  std::vector<Vector3d> sum(mesh.points.size(), Vector3d::Zero());
  std::vector<int> count(mesh.points.size());
  for (std::size_t t = 0; t < old.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t point = point_of[3 * t + k];
      mesh.triangles[t][k] = point;
      if (!is_cut[old[t][k]]) continue;
      for (int other = 1; other < 3; ++other) sum[point] += places[old[t][(k + other) % 3]];
      count[point] += 2;
    }
  for (std::size_t i = 0; i < count.size(); ++i)
    if (count[i] > 0) mesh.points[i] += kApart * (sum[i] / count[i] - places[i]);
  return cut;
}

double area_of(const Mesh& mesh, std::uint32_t t) {
  const auto& [a, b, c] = mesh.triangles[t];
  return (mesh.points[b] - mesh.points[a]).cross(mesh.points[c] - mesh.points[a]).norm() / 2;
}

/// Of edges that still have two triangles on one side, all but the largest on each.
std::vector<std::uint8_t> without_crowded(const Mesh& mesh) {
  std::vector<std::uint8_t> keep(mesh.triangles.size(), 1);
  const std::vector<Side> sides = sides_of(mesh);
  for_each_edge(sides, [&](std::size_t begin, std::size_t end) {
    for (const bool upwards : {false, true}) {
      std::optional<std::uint32_t> largest;
      for (std::size_t i = begin; i < end; ++i) {
        if (sides[i].upwards != upwards || !keep[sides[i].triangle]) continue;
        if (!largest) {
          largest = sides[i].triangle;
          continue;
        }
        const bool larger = area_of(mesh, sides[i].triangle) > area_of(mesh, *largest);
        keep[larger ? *largest : sides[i].triangle] = 0;
        if (larger) largest = sides[i].triangle;
      }
    }
  });
  return keep;
}

std::int64_t zeros(const std::vector<std::uint8_t>& keep) { return std::count(keep.begin(), keep.end(), 0); }

/// Fans of each triangle's corners, as the edges pair them.
TriangleFans fans_of(const Mesh& mesh) {
  TriangleFans corners(mesh);
  const std::vector<Side> sides = sides_of(mesh);
  for_each_edge(sides, [&](std::size_t begin, std::size_t end) {
    pair_sides(mesh, sides.data() + begin, sides.data() + end, corners);
  });
  return corners;
}

}  // namespace

ManifoldSurface made_manifold(const Surface& surface) {
  ManifoldSurface out{surface, 0, 0};
  std::vector<std::uint8_t> keep = single_triangles(surface.mesh);
  while (true) {
    out.dropped += zeros(keep);
    if (zeros(keep) > 0) out.surface = kept_triangles(out.surface, keep);
    TriangleFans fans = fans_of(out.surface.mesh);
    out.cut += split_points(out.surface, fans);
    keep = without_crowded(out.surface.mesh);
    if (zeros(keep) == 0) return out;
  }
}

bool is_manifold(const Mesh& mesh) {
  const std::vector<Side> sides = sides_of(mesh);
  bool fits = true;
  for_each_edge(sides, [&](std::size_t begin, std::size_t end) {
    if (end - begin > 2 || (end - begin == 2 && sides[begin].upwards == sides[begin + 1].upwards))
      fits = false;
  });
  if (!fits) return false;
  TriangleFans fans = fans_of(mesh);
  std::vector<std::optional<std::uint32_t>> fan(mesh.points.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      std::optional<std::uint32_t>& known = fan[mesh.triangles[t][k]];
      const std::uint32_t set = fans.find(3 * t + k);
      if (known && *known != set) return false;
      known = set;
    }
  return true;
}

}  // namespace roxel

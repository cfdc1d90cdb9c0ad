#include "roxel/surface/surface_extraction.h"

#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "roxel/base/parallel.h"
#include "roxel/surface/distance_voxels.inl"
#include "roxel/surface/manifold.h"

namespace roxel {
namespace {

using Eigen::Vector3d;
using openvdb::Coord;

constexpr int kRelaxRounds = 4;
constexpr float kRelaxStep = 0.5f;       ///< of the way to the middle of a point's neighbours
constexpr float kLeastGradient = 0.25f;  ///< of a distance, where it tells the way to its surface
constexpr float kFarthestMove = 0.75f;   ///< in lattice steps, a round

struct LatticeMesh {
  std::vector<openvdb::Vec3s> points;  ///< in lattice steps
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

double squared(const openvdb::Vec3s& a, const openvdb::Vec3s& b) { return (a - b).lengthSqr(); }

/// Two triangles along the shorter diagonal. The outside (distance > 0) sees OpenVDB's corners
/// counterclockwise.
void add_quad(const openvdb::Vec4I& q, LatticeMesh& mesh) {
  const auto& p = mesh.points;
  if (squared(p[q[0]], p[q[2]]) <= squared(p[q[1]], p[q[3]])) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  } else {
    mesh.triangles.push_back({q[0], q[1], q[3]});
    mesh.triangles.push_back({q[1], q[2], q[3]});
  }
}

LatticeMesh zero_surface(const openvdb::FloatTree::Ptr& distance) {
  const openvdb::FloatGrid::Ptr grid = make_grid<openvdb::FloatGrid>();  // of lattice steps
  grid->setTree(distance);
  LatticeMesh mesh;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*grid, mesh.points, triangles, quads, 0.0, 0.0, false);
  for (const openvdb::Vec4I& quad : quads) add_quad(quad, mesh);
  for (const openvdb::Vec3I& t : triangles) mesh.triangles.push_back({t[0], t[1], t[2]});
  return mesh;
}

/// How well a piece of surface is known.
enum class Support : std::uint8_t {
  kNone,    ///< at the end of what is known: no surface at all
  kWeak,    ///< views saw too little of it, or none did and it was carried on from around
  kStrong,  ///< enough views saw it
};

class SupportOfCells {
 public:
  SupportOfCells(const DistanceField::Voxels& voxels, int min_views)
      : weight_(*voxels.weight), views_(*voxels.views), min_views_(static_cast<float>(min_views)) {}

  /// Of the cell that a point lies in.
  Support operator()(const openvdb::Vec3s& point) const {
    const Coord base = Coord::floor(openvdb::Vec3d(point));
    bool seen = true;
    float most = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Coord ijk = base.offsetBy(corner & 1, corner >> 1 & 1, corner >> 2);
      const float views = views_.getValue(ijk);
      if (weight_.getValue(ijk) > 0) {
        most = std::max(most, views);
      } else {
        seen = false;
        if (views != DistanceField::kFilled) return Support::kNone;
      }
    }
    return seen && most >= min_views_ ? Support::kStrong : Support::kWeak;
  }

 private:
  openvdb::tree::ValueAccessor<const openvdb::FloatTree> weight_, views_;
  float min_views_;
};

/// Of every triangle: that of its weakest point.
std::vector<Support> support_of_triangles(const LatticeMesh& mesh, const DistanceField::Voxels& voxels,
                                          int min_views) {
  const SupportOfCells of_cell(voxels, min_views);
  std::vector<Support> of_point(mesh.points.size());
  for (std::size_t i = 0; i < of_point.size(); ++i) of_point[i] = of_cell(mesh.points[i]);
  std::vector<Support> support(mesh.triangles.size());
  for (std::size_t t = 0; t < support.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    support[t] = std::min({of_point[a], of_point[b], of_point[c]});
  }
  return support;
}

/// The longest side of each component's box, lattice steps.
std::vector<double> extents(const LatticeMesh& mesh, const Components& components) {
  std::vector<Eigen::AlignedBox3f> boxes(components.count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (components.of_triangle[t] == kNoComponent) continue;
    for (const std::uint32_t corner : mesh.triangles[t]) {
      const openvdb::Vec3s& p = mesh.points[corner];
      boxes[components.of_triangle[t]].extend(Eigen::Vector3f(p.x(), p.y(), p.z()));
    }
  }
  std::vector<double> sides;
  for (const auto& box : boxes) sides.push_back(box.sizes().maxCoeff());
  return sides;
}

Mesh topology_of(const LatticeMesh& mesh) {
  Mesh out;
  out.points.resize(mesh.points.size());
  out.triangles = mesh.triangles;
  return out;
}

/// Takes out parts of less extent than that; returns how many triangles.
std::int64_t drop_small_parts(const LatticeMesh& mesh, const Mesh& topology, double smallest,
                              std::vector<std::uint8_t>& keep) {
  const Components parts = connected_components(topology, keep);
  const std::vector<double> sides = extents(mesh, parts);
  std::int64_t dropped = 0;
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (keep[t] && sides[parts.of_triangle[t]] < smallest) {
      keep[t] = 0;
      ++dropped;
    }
  return dropped;
}

/// Adds what closes small holes: weak pieces all of whose edges lie on kept surface. Returns how many
/// triangles.
std::int64_t close_holes(const LatticeMesh& mesh, const Mesh& topology, const FaceNeighbours& neighbours,
                         const std::vector<Support>& support, double hole_size,
                         std::vector<std::uint8_t>& keep) {
  std::vector<std::uint8_t> weak(keep.size());
  for (std::size_t t = 0; t < keep.size(); ++t) weak[t] = !keep[t] && support[t] != Support::kNone;
  const Components pieces = connected_components(topology, weak);
  std::vector<double> sides = extents(mesh, pieces);
  std::vector<std::uint8_t> rimmed(
      pieces.count);  // a closed piece that touches nothing is no hole, but debris
  for (std::size_t t = 0; t < keep.size(); ++t) {
    if (!weak[t]) continue;
    for (const std::int32_t n : neighbours[t]) {
      if (n >= 0 && keep[n]) rimmed[pieces.of_triangle[t]] = 1;
      if (n < 0 || !(keep[n] || weak[n]))
        sides[pieces.of_triangle[t]] = std::numeric_limits<double>::infinity();
    }
  }
  std::int64_t closed = 0;
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (weak[t] && rimmed[pieces.of_triangle[t]] && sides[pieces.of_triangle[t]] <= hole_size) {
      keep[t] = 1;
      ++closed;
    }
  return closed;
}

/// A distance between the corners of a lattice, in lattice steps.
class Interpolated {
 public:
  explicit Interpolated(const DistanceField::Voxels& voxels)
      : distance_(*voxels.distance), inverse_step_(static_cast<float>(1 / voxels.voxel_size)) {}

  struct Value {
    float distance;
    openvdb::Vec3s gradient;
  };
  /// None where the field does not hold all corners around the point.
  std::optional<Value> operator()(const openvdb::Vec3s& at) const {
    const Coord base = Coord::floor(openvdb::Vec3d(at));
    float c[8];
    for (int corner = 0; corner < 8; ++corner) {
      if (!distance_.probeValue(base.offsetBy(corner & 1, corner >> 1 & 1, corner >> 2), c[corner]))
        return {};
      c[corner] *= inverse_step_;
    }
    const float x = at.x() - static_cast<float>(base.x()), y = at.y() - static_cast<float>(base.y()),
                z = at.z() - static_cast<float>(base.z());
    const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
    const float x00 = mix(c[0], c[1], x), x10 = mix(c[2], c[3], x), x01 = mix(c[4], c[5], x),
                x11 = mix(c[6], c[7], x);
    const float y0 = mix(x00, x10, y), y1 = mix(x01, x11, y);
    const openvdb::Vec3s gradient(mix(mix(c[1] - c[0], c[3] - c[2], y), mix(c[5] - c[4], c[7] - c[6], y), z),
                                  mix(x10 - x00, x11 - x01, z), y1 - y0);
    return Value{mix(y0, y1, z), gradient};
  }

 private:
  openvdb::tree::ValueAccessor<const openvdb::FloatTree> distance_;
  float inverse_step_;
};

/// Moves points along the surface towards the middle of their neighbours, and back onto it: those of the dual
/// method lie anywhere in their cells, and its triangles are slivers where the surface passes close to a
/// corner of the lattice. Points at open edges stay.
void relax(const DistanceField::Voxels& voxels, const FaceNeighbours& neighbours, int threads,
           LatticeMesh& mesh) {
  constexpr std::int64_t kGrain = 1 << 13;
  std::vector<std::uint8_t> fixed(mesh.points.size());
  for (std::size_t t = 0; t < neighbours.size(); ++t)
    for (int k = 0; k < 3; ++k)
      if (neighbours[t][k] < 0) fixed[mesh.triangles[t][k]] = fixed[mesh.triangles[t][(k + 1) % 3]] = 1;
  std::vector<openvdb::Vec3s> sum(mesh.points.size());
  std::vector<int> count(mesh.points.size());
  for (int round = 0; round < kRelaxRounds; ++round) {
    std::fill(sum.begin(), sum.end(), openvdb::Vec3s(0, 0, 0));
    std::fill(count.begin(), count.end(), 0);
    for (const auto& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        sum[t[k]] += mesh.points[t[(k + 1) % 3]] + mesh.points[t[(k + 2) % 3]];
        count[t[k]] += 2;
      }
    parallel_for_blocks(std::ssize(sum), kGrain, threads, [&](std::int64_t begin, std::int64_t end, int) {
      const Interpolated field(voxels);
      for (std::int64_t i = begin; i < end; ++i) {
        if (fixed[i] || count[i] == 0) continue;
        const openvdb::Vec3s from = mesh.points[i];
        openvdb::Vec3s to = from + kRelaxStep * (sum[i] / static_cast<float>(count[i]) - from);
        const auto there = field(to);
        if (!there || there->gradient.lengthSqr() < kLeastGradient * kLeastGradient) continue;
        to -= there->distance / there->gradient.lengthSqr() * there->gradient;
        if ((to - from).lengthSqr() < kFarthestMove * kFarthestMove) mesh.points[i] = to;
      }
    });
  }
}

}  // namespace

Extraction extract_surface(const DistanceField& field, const ExtractionOptions& options) {
  const DistanceField::Voxels& voxels = field.voxels();
  LatticeMesh mesh = zero_surface(voxels.distance);
  Surface whole;
  whole.mesh = topology_of(mesh);
  Extraction out;
  const std::vector<Support> support = support_of_triangles(mesh, voxels, options.min_views);
  std::vector<std::uint8_t> keep(support.size());
  for (std::size_t t = 0; t < keep.size(); ++t) keep[t] = support[t] == Support::kStrong;
  out.unsupported = std::count(keep.begin(), keep.end(), 0);
  out.debris = drop_small_parts(mesh, whole.mesh, options.smallest_part, keep);
  const FaceNeighbours neighbours = face_neighbours(whole.mesh);
  out.closed = close_holes(mesh, whole.mesh, neighbours, support, options.hole_size, keep);
  out.unsupported -= out.closed;
  relax(voxels, neighbours, options.threads, mesh);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const openvdb::Vec3s& p = mesh.points[i];
    whole.mesh.points[i] = voxels.origin + voxels.voxel_size * Vector3d(p.x(), p.y(), p.z());
  }
  out.surface = made_manifold(kept_triangles(whole, keep)).surface;
  return out;
}

}  // namespace roxel

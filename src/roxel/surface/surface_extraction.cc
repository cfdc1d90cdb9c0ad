#include "roxel/surface/surface_extraction.h"

#include <openvdb/tools/VolumeToMesh.h>

#include <cmath>

#include "roxel/surface/distance_voxels.inl"

namespace roxel {
namespace {

using Eigen::Vector3d;
using openvdb::Coord;

struct LatticeMesh {
  std::vector<openvdb::Vec3s> points;  ///< in lattice steps
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

double squared(const openvdb::Vec3s& a, const openvdb::Vec3s& b) { return (a - b).lengthSqr(); }

/// Two triangles along the shorter diagonal, turned so that the outside (distance > 0) sees them
/// counterclockwise.
void add_quad(const openvdb::Vec4I& q, LatticeMesh& mesh) {
  const auto& p = mesh.points;
  if (squared(p[q[0]], p[q[2]]) <= squared(p[q[1]], p[q[3]])) {
    mesh.triangles.push_back({q[0], q[2], q[1]});
    mesh.triangles.push_back({q[0], q[3], q[2]});
  } else {
    mesh.triangles.push_back({q[0], q[3], q[1]});
    mesh.triangles.push_back({q[1], q[3], q[2]});
  }
}

LatticeMesh zero_surface(const openvdb::FloatTree::Ptr& distance) {
  const openvdb::FloatGrid grid(distance);  // its transform is that of lattice steps
  openvdb::tools::VolumeToMesh mesher(0.0, 0.0, false);
  mesher(grid);
  LatticeMesh mesh;
  mesh.points.assign(mesher.pointList().get(), mesher.pointList().get() + mesher.pointListSize());
  for (std::size_t n = 0; n < mesher.polygonPoolListSize(); ++n) {
    const openvdb::tools::PolygonPool& pool = mesher.polygonPoolList()[n];
    for (std::size_t i = 0; i < pool.numQuads(); ++i) add_quad(pool.quad(i), mesh);
    for (std::size_t i = 0; i < pool.numTriangles(); ++i) {
      const openvdb::Vec3I& t = pool.triangle(i);
      mesh.triangles.push_back({t[0], t[2], t[1]});
    }
  }
  return mesh;
}

/// What is known of the cell that a point lies in.
struct CellSupport {
  bool known = true;  ///< views have said something of all its corners
  float views = 0;    ///< most that see a surface near one of its corners
};

class Support {
 public:
  explicit Support(const DistanceField::Voxels& voxels) : weight_(*voxels.weight), views_(*voxels.views) {}
  CellSupport operator()(const openvdb::Vec3s& point) {
    const Coord base = Coord::floor(openvdb::Vec3d(point));
    CellSupport support;
    for (int corner = 0; corner < 8; ++corner) {
      const Coord ijk = base.offsetBy(corner & 1, corner >> 1 & 1, corner >> 2);
      support.known &= weight_.getValue(ijk) > 0;
      support.views = std::max(support.views, views_.getValue(ijk));
    }
    return support;
  }

 private:
  openvdb::tree::ValueAccessor<const openvdb::FloatTree> weight_, views_;
};

std::vector<std::uint8_t> supported_triangles(const LatticeMesh& mesh, const DistanceField::Voxels& voxels,
                                              int min_views) {
  Support support(voxels);
  std::vector<std::uint8_t> good(mesh.points.size());
  for (std::size_t i = 0; i < good.size(); ++i) {
    const CellSupport cell = support(mesh.points[i]);
    good[i] = cell.known && cell.views >= static_cast<float>(min_views);
  }
  std::vector<std::uint8_t> keep(mesh.triangles.size());
  for (std::size_t t = 0; t < keep.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    keep[t] = good[a] && good[b] && good[c];
  }
  return keep;
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

}  // namespace

Extraction extract_surface(const DistanceField& field, const ExtractionOptions& options) {
  const DistanceField::Voxels& voxels = field.voxels();
  const LatticeMesh mesh = zero_surface(voxels.distance);
  Surface whole;
  whole.mesh = topology_of(mesh);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const openvdb::Vec3s& p = mesh.points[i];
    whole.mesh.points[i] = voxels.origin + voxels.voxel_size * Vector3d(p.x(), p.y(), p.z());
  }
  Extraction out;
  std::vector<std::uint8_t> keep = supported_triangles(mesh, voxels, options.min_views);
  out.unsupported = std::count(keep.begin(), keep.end(), 0);
  const Components parts = connected_components(whole.mesh, keep);
  const std::vector<double> sides = extents(mesh, parts);
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (keep[t] && sides[parts.of_triangle[t]] < options.smallest_part) {
      keep[t] = 0;
      ++out.debris;
    }
  out.surface = kept_triangles(whole, keep);
  return out;
}

}  // namespace roxel

#include "roxel/surface/simplification.h"

#include <meshoptimizer.h>

#include <algorithm>

#include "roxel/base/error.h"
#include "roxel/surface/manifold.h"

namespace roxel {
namespace {

/// In floats about the middle, so that large coordinates lose nothing.
std::vector<float> centred_positions(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& x : mesh.points) box.extend(x);
  std::vector<float> positions;
  positions.reserve(3 * mesh.points.size());
  for (const Eigen::Vector3d& x : mesh.points)
    for (int axis = 0; axis < 3; ++axis)
      positions.push_back(static_cast<float>(x[axis] - box.center()[axis]));
  return positions;
}

}  // namespace

Surface simplified(const Surface& surface, const SimplificationOptions& options) {
  const Mesh& mesh = surface.mesh;
  const std::int64_t wanted = options.triangles.value_or(0);
  if (mesh.triangles.empty() || (options.triangles && wanted >= std::ssize(mesh.triangles))) return surface;
  const std::vector<float> positions = centred_positions(mesh);
  std::vector<unsigned> corners;
  corners.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) corners.insert(corners.end(), triangle.begin(), triangle.end());
  constexpr std::size_t kStride = 3 * sizeof(float);
  const double scale = meshopt_simplifyScale(positions.data(), mesh.points.size(), kStride);
  const double error = options.triangles ? 1.0 : options.error / scale;
  std::vector<unsigned> left(corners.size());
  left.resize(meshopt_simplify(left.data(), corners.data(), corners.size(), positions.data(),
                               mesh.points.size(), kStride, static_cast<std::size_t>(3 * wanted),
                               static_cast<float>(error), 0, nullptr));
  const auto count = static_cast<std::int64_t>(left.size() / 3);
  if (options.triangles && count > wanted)
    throw InvalidInput("a surface of " + std::to_string(mesh.triangles.size()) +
                       " triangles: found a target of " + std::to_string(wanted) + ", expected at least " +
                       std::to_string(count) + ", the fewest that its parts can be drawn with");
  Surface fewer = surface;
  fewer.mesh.triangles.clear();
  for (std::size_t t = 0; t + 2 < left.size(); t += 3)
    fewer.mesh.triangles.push_back({left[t], left[t + 1], left[t + 2]});
  return made_manifold(kept_triangles(fewer, std::vector<std::uint8_t>(fewer.mesh.triangles.size(), 1)))
      .surface;  // collapses may let sheets touch
}

}  // namespace roxel

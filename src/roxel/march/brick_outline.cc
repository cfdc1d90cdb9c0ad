#include "roxel/march/brick_outline.h"

namespace roxel {

namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

void include(const Eigen::Vector3d& projected, BrickOutline& outline) {
  const double inverse = 1 / projected.z();
  outline.u0 = std::min(outline.u0, projected.x() * inverse);
  outline.u1 = std::max(outline.u1, projected.x() * inverse);
  outline.v0 = std::min(outline.v0, projected.y() * inverse);
  outline.v1 = std::max(outline.v1, projected.y() * inverse);
}

}  // namespace

BrickProjection::BrickProjection(const LatticeFrame& frame, const PinholeCamera& camera) {
  const Eigen::Matrix3d projection = camera.intrinsics.matrix() * camera.pose.rotation;
  const double side = kBrickSide * frame.voxel_size;
  for (int a = 0; a < 3; ++a) edges_[a] = side * projection.col(a);
  origin_ = projection * (frame.origin - camera.pose.centre);
}

BrickOutline BrickProjection::outline(const Eigen::Vector3i& brick) const {
  const Eigen::Vector3d base =
      origin_ + brick.x() * edges_[0] + brick.y() * edges_[1] + brick.z() * edges_[2];
  Eigen::Vector3d corners[8];
  Stretch depth{kUnbounded, -kUnbounded};
  for (int corner = 0; corner < 8; ++corner) {
    corners[corner] = base;
    for (int a = 0; a < 3; ++a)
      if (corner >> a & 1) corners[corner] += edges_[a];
    depth.begin = std::min(depth.begin, corners[corner].z());
    depth.end = std::max(depth.end, corners[corner].z());
  }
  const double nearest = 1e-3 * (depth.end - depth.begin);
  if (depth.begin <= nearest && depth.end > 0) return cut_outline(corners, nearest);
  BrickOutline outline{kUnbounded, -kUnbounded, kUnbounded, -kUnbounded, depth};
  if (depth.end > 0)
    for (const Eigen::Vector3d& corner : corners) include(corner, outline);
  return outline;
}

/// The outline of what is beyond the depth `nearest`. Everything nearer is as near to the centre as a few
/// times that: bricks that hold the centre, or nearly, are everywhere.
BrickOutline BrickProjection::cut_outline(const Eigen::Vector3d corners[8], double nearest) const {
  BrickOutline outline{kUnbounded, -kUnbounded, kUnbounded, -kUnbounded, {0, 0}};
  for (int corner = 0; corner < 8; ++corner)
    outline.depth.end = std::max(outline.depth.end, corners[corner].z());
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d& p = corners[corner];
    if (p.z() >= nearest) include(p, outline);
    for (int a = 0; a < 3; ++a) {
      if (corner >> a & 1) continue;
      const Eigen::Vector3d& q = corners[corner | 1 << a];
      if ((p.z() < nearest) == (q.z() < nearest)) continue;
      include(p + (nearest - p.z()) / (q.z() - p.z()) * (q - p), outline);
    }
  }
  // In the brick's own coordinates, in edges: where the camera's centre is.
  Eigen::Matrix3d edges;
  for (int a = 0; a < 3; ++a) edges.col(a) = edges_[a];
  const Eigen::Vector3d centre = -(edges.inverse() * corners[0]);
  constexpr double kClose = 0.1;
  bool close = true;
  for (int a = 0; a < 3; ++a) close &= centre[a] > -kClose && centre[a] < 1 + kClose;
  if (close) return {-kUnbounded, kUnbounded, -kUnbounded, kUnbounded, outline.depth};
  return outline;
}

}  // namespace roxel

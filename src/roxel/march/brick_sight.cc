#include "roxel/march/brick_sight.h"

namespace roxel {

namespace {

constexpr Stretch kNothing{std::numeric_limits<double>::infinity(), 0};
/// Rounding must not cost a voxel: bricks count as wider by this many pixels and this share of their depth.
constexpr double kMarginPx = 0.01;
constexpr double kMarginDepth = 1e-6;

/// A brick in the image: pixel bounds and depths of its corners.
struct Outline {
  double u0, u1, v0, v1;
  Stretch depth;
};

/// `base` is K (x - centre) of the brick's first corner, `edges` those of its three edges. Everywhere (u, v
/// unbounded) if the brick reaches behind the camera.
Outline outline_of(const Eigen::Vector3d& base, const Eigen::Vector3d edges[3]) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Outline outline{kInfinity, -kInfinity, kInfinity, -kInfinity, kNothing};
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d p = base;
    for (int a = 0; a < 3; ++a)
      if (corner >> a & 1) p += edges[a];
    outline.depth.begin = std::min(outline.depth.begin, p.z());
    outline.depth.end = std::max(outline.depth.end, p.z());
    const double inverse = 1 / p.z();
    outline.u0 = std::min(outline.u0, p.x() * inverse);
    outline.u1 = std::max(outline.u1, p.x() * inverse);
    outline.v0 = std::min(outline.v0, p.y() * inverse);
    outline.v1 = std::max(outline.v1, p.y() * inverse);
  }
  const double size = outline.depth.end - outline.depth.begin;
  if (outline.depth.begin <= 1e-3 * size)
    return {-kInfinity, kInfinity, -kInfinity, kInfinity, {0, outline.depth.end}};
  return outline;
}

/// Tiles [first, second) that the pixel range [low, high] touches.
std::pair<int, int> tiles_of(double low, double high, int count) {
  constexpr double kSide = BrickSight::kTileSide;
  const double limit = count * kSide;
  const double from = std::clamp(low - kMarginPx, 0.0, limit);
  const double to = std::clamp(high + kMarginPx, -1.0, limit);
  if (to < 0 || low - kMarginPx > limit) return {0, 0};
  return {std::min(static_cast<int>(from / kSide), count - 1),
          std::min(static_cast<int>(to / kSide), count - 1) + 1};
}

}  // namespace

BrickSight::BrickSight(const LatticeStack& stack, const PinholeCamera& camera)
    : columns_((camera.intrinsics.width + kTileSide - 1) / kTileSide),
      rows_((camera.intrinsics.height + kTileSide - 1) / kTileSide),
      lattices_(stack.volume().lattice_count()),
      stretches_(static_cast<std::size_t>(columns_) * rows_ * lattices_, kNothing) {
  for (int k = 0; k < lattices_; ++k) add_lattice(stack.volume().index(k), k, camera);
}

void BrickSight::add_lattice(const BrickIndex& index, int lattice, const PinholeCamera& camera) {
  const LatticeFrame& frame = index.frame();
  const Eigen::Matrix3d projection = camera.intrinsics.matrix() * camera.pose.rotation;
  const double side = kBrickSide * frame.voxel_size;
  const Eigen::Vector3d edges[3] = {side * projection.col(0), side * projection.col(1),
                                    side * projection.col(2)};
  const Eigen::Vector3d origin = projection * (frame.origin - camera.pose.centre);
  for (const Brick& brick : index.bricks()) {
    const Eigen::Vector3d base =
        origin + brick.coord.x() * edges[0] + brick.coord.y() * edges[1] + brick.coord.z() * edges[2];
    const Outline outline = outline_of(base, edges);
    if (outline.depth.end <= 0) continue;
    const auto [x0, x1] = tiles_of(outline.u0, outline.u1, columns_);
    const auto [y0, y1] = tiles_of(outline.v0, outline.v1, rows_);
    const Stretch depth{outline.depth.begin * (1 - kMarginDepth), outline.depth.end * (1 + kMarginDepth)};
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) {
        Stretch& tile = stretches_[static_cast<std::size_t>(y * columns_ + x) * lattices_ + lattice];
        tile = {std::min(tile.begin, depth.begin), std::max(tile.end, depth.end)};
      }
  }
}

}  // namespace roxel

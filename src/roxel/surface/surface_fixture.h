#pragma once
/// For tests: a ball that cameras around it see, with depth and colours that can be computed by hand.

#include <cmath>
#include <optional>

#include "roxel/surface/depth_fusion.h"
#include "roxel/surface/mesh_picture.h"
#include "roxel/surface/texture_views.h"

namespace roxel::fixture {

inline constexpr double kBallRadius = 1;

/// Cameras at the corners of a cube around the ball, four of them (a tetrahedron) or all eight; they see what
/// lies within `seen` of its centre.
inline std::vector<PinholeCamera> cameras_around(int count = 8, int size_px = 96,
                                                 double seen = 1.2 * kBallRadius) {
  std::vector<PinholeCamera> cameras;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d direction(i & 1 ? 1 : -1, i & 2 ? 1 : -1, (i & 4 ? 1 : -1) * 0.7);
    cameras.push_back(
        orbit_camera(Eigen::Vector3d::Zero(), seen, direction, Eigen::Vector3d::UnitZ(), size_px));
  }
  return cameras;
}

/// Where the ray meets the ball (or one elsewhere), in units of its direction.
inline std::optional<double> meet_ball(const Ray& ray, const Eigen::Vector3d& centre = {0, 0, 0},
                                       double radius = kBallRadius) {
  const Eigen::Vector3d from_centre = ray.origin - centre;
  const double a = ray.direction.squaredNorm(), b = from_centre.dot(ray.direction),
               c = from_centre.squaredNorm() - radius * radius;
  const double inner = b * b - a * c;
  if (inner < 0) return {};
  return (-b - std::sqrt(inner)) / a;
}

/// The ball's depth, of that variance; opacity 0 beside it.
inline FusionView ball_view(const PinholeCamera& camera, float variance = 1e-4f) {
  const int width = camera.intrinsics.width, height = camera.intrinsics.height;
  FusionView view{
      camera, Image(width, height, 1), Image(width, height, 1, variance), Image(width, height, 1), {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (const auto t = meet_ball(camera.ray(x + 0.5, y + 0.5))) {
        *view.depth.pixel(x, y) = static_cast<float>(*t);
        *view.opacity.pixel(x, y) = 1;
      }
  return view;
}

inline FusionOptions ball_fusion(double half_box = 1.5) {
  FusionOptions options;
  options.voxel_size = 0.08;
  options.box = {Eigen::Vector3d::Constant(-half_box), Eigen::Vector3d::Constant(half_box)};
  return options;
}

/// A colour for every place, with slopes that bilinear sampling follows well.
inline Rgb color_at(const Eigen::Vector3d& x) {
  return {static_cast<float>(0.5 + 0.3 * x.x()), static_cast<float>(0.5 + 0.3 * x.y()),
          static_cast<float>(0.5 + 0.3 * x.z())};
}

/// What the camera sees of the ball in those colours times `light`; the rest is not usable.
inline TextureView ball_photograph(const PinholeCamera& camera, float light = 1) {
  TextureView view{camera, Image(camera.intrinsics.width, camera.intrinsics.height, 3),
                   Mask(camera.intrinsics.width, camera.intrinsics.height, 0)};
  for (int y = 0; y < view.rgb.height(); ++y)
    for (int x = 0; x < view.rgb.width(); ++x) {
      const Ray ray = camera.ray(x + 0.5, y + 0.5);
      const auto t = meet_ball(ray);
      if (!t) continue;
      const Rgb color = color_at(ray.origin + *t * ray.direction);
      for (int c = 0; c < 3; ++c) view.rgb.pixel(x, y)[c] = light * color[c];
      view.usable.at(x, y) = 255;
    }
  return view;
}

/// The unit ball as a mesh: a cube of n x n squares a side, blown up.
inline Surface ball_mesh(int n) {
  Surface ball;
  for (int axis = 0; axis < 3; ++axis)
    for (int sign : {-1, 1}) {
      const auto first = static_cast<std::uint32_t>(ball.mesh.points.size());
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) {
          Eigen::Vector3d x;
          x[axis] = sign;
          x[(axis + 1) % 3] = sign * (2.0 * i / n - 1);
          x[(axis + 2) % 3] = 2.0 * j / n - 1;
          ball.mesh.points.push_back(x.normalized());
        }
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const std::uint32_t a = first + i + j * (n + 1), b = a + 1, c = a + n + 1, d = c + 1;
          ball.mesh.triangles.push_back({a, b, d});
          ball.mesh.triangles.push_back({a, d, c});
        }
    }
  ball.normals = point_normals(ball.mesh);
  for (const Eigen::Vector3d& x : ball.mesh.points) ball.colors.push_back(color_at(x));
  return ball;
}

}  // namespace roxel::fixture

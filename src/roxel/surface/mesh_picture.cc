#include "roxel/surface/mesh_picture.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/parallel.h"
#include "roxel/color/color_space.h"

namespace roxel {
namespace {

using Eigen::Vector3d;
using Color = std::array<float, 3>;

/// Averages the colours of rays over each pixel; `shade` gives display values.
template <class Shade>
Image picture(const MeshRays& rays, const PinholeCamera& camera, const MeshPictureOptions& options,
              const Shade& shade) {
  Image out(camera.intrinsics.width, camera.intrinsics.height, 3);
  const int n = options.samples;
  parallel_for(out.height(), options.threads, [&](std::int64_t row, int) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < out.width(); ++x)
      for (int s = 0; s < n * n; ++s) {
        const Ray ray = camera.ray(x + (s % n + 0.5) / n, y + (s / n + 0.5) / n);
        const auto hit = rays.trace(ray.origin, ray.direction);
        const Color color = hit ? shade(*hit, ray) : options.background;
        for (int c = 0; c < 3; ++c) out.pixel(x, y)[c] += color[c] / static_cast<float>(n * n);
      }
  });
  return out;
}

Vector3d normal_of(const Mesh& mesh, std::uint32_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  return (mesh.points[b] - mesh.points[a]).cross(mesh.points[c] - mesh.points[a]).normalized();
}

}  // namespace

Image shaded_picture(const Surface& surface, const MeshRays& rays, const PinholeCamera& camera,
                     const MeshPictureOptions& options) {
  const Vector3d light = camera.pose.rotation.transpose() * Vector3d(-0.4, -0.6, -0.7).normalized();
  return picture(rays, camera, options, [&](const MeshHit& hit, const Ray& ray) -> Color {
    const Vector3d flat = normal_of(surface.mesh, hit.triangle);
    const bool behind = flat.dot(ray.direction) > 0;
    Vector3d normal = flat;
    if (!surface.normals.empty()) {
      normal.setZero();
      for (int k = 0; k < 3; ++k)
        normal += hit.corners[k] * surface.normals[surface.mesh.triangles[hit.triangle][k]].cast<double>();
      normal.normalize();
    }
    const auto value =
        static_cast<float>(0.2 + 0.75 * std::max(0.0, (behind ? -1.0 : 1.0) * normal.dot(light)));
    return behind ? Color{value * 0.75f, value * 0.5f, value * 0.35f} : Color{value, value, value};
  });
}

Image colored_picture(const MeshRays& rays, const PinholeCamera& camera, const HitColor& color,
                      const MeshPictureOptions& options) {
  return picture(rays, camera, options, [&](const MeshHit& hit, const Ray&) {
    Color shown = color(hit);
    for (float& value : shown) value = std::clamp(srgb_encode(value), 0.0f, 1.0f);
    return shown;
  });
}

HitColor point_colors(const Surface& surface) {
  return [&surface](const MeshHit& hit) {
    Color sum{};
    for (int k = 0; k < 3; ++k)
      for (int c = 0; c < 3; ++c)
        sum[c] +=
            static_cast<float>(hit.corners[k]) * surface.colors[surface.mesh.triangles[hit.triangle][k]][c];
    return sum;
  };
}

PinholeCamera orbit_camera(const Vector3d& middle, double radius, const Vector3d& direction,
                           const Vector3d& up, int size_px) {
  constexpr double kDistance = 4;  // radii; the ball's outline then is at 1 / sqrt(kDistance^2 - 1)
  PinholeCamera camera;
  const double f = 0.49 * size_px * std::sqrt(kDistance * kDistance - 1);
  camera.intrinsics = {size_px, size_px, f, f, 0.5 * size_px, 0.5 * size_px, 0};
  const Vector3d forward = -direction.normalized();
  const Vector3d right = forward.cross(up).normalized();
  camera.pose.rotation.row(0) = right;
  camera.pose.rotation.row(1) = forward.cross(right);
  camera.pose.rotation.row(2) = forward;
  camera.pose.centre = middle - kDistance * radius * forward;
  return camera;
}

}  // namespace roxel

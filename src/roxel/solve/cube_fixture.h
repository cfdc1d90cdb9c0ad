#pragma once
/// For tests: a textured cube, ray cast, photographed from all around with exact cameras.

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "roxel/dataset/dataset.h"
#include "roxel/march/ray_walk.h"

namespace roxel::fixture {

/// The cube [-0.5, 0.5]^3 with a coloured patch pattern on each face, before a plain background or in the
/// middle of a patterned sphere.
class CubeWorld {
 public:
  static Eigen::AlignedBox3d cube() {
    return {Eigen::Vector3d::Constant(-0.5), Eigen::Vector3d::Constant(0.5)};
  }

  /// Depth at which the ray enters the cube.
  static std::optional<double> hit(const Ray& ray) {
    const Stretch inside = clip_to_box(ray, cube(), {0, 1e9});
    if (inside.end <= inside.begin) return std::nullopt;
    return inside.begin;
  }

  /// Linear RGB of the surface: squares of an eighth of the side, each with a colour of its own.
  static std::array<float, 3> color_at(const Eigen::Vector3d& x) {
    return patch_color((x.array() + 0.5) * 7.999);
  }

  /// Of the sphere around the world, radius 8.
  static std::array<float, 3> sphere_color(const Ray& ray) {
    const double b = ray.origin.dot(ray.direction), a = ray.direction.squaredNorm();
    const double t = (-b + std::sqrt(b * b - a * (ray.origin.squaredNorm() - 64))) / a;
    return patch_color((ray.origin + t * ray.direction).array() + 100);
  }

  /// The mean over 4 x 4 rays a pixel; `mask` gets the share of them that meets the cube.
  static Photograph photograph(const PinholeCamera& camera,
                               const std::optional<std::array<float, 3>>& background, bool mask) {
    constexpr int kRays = 4;
    Photograph photo;
    photo.rgb = Image(camera.intrinsics.width, camera.intrinsics.height, 3);
    if (mask) photo.foreground = Mask(camera.intrinsics.width, camera.intrinsics.height, 0);
    for (int y = 0; y < camera.intrinsics.height; ++y)
      for (int x = 0; x < camera.intrinsics.width; ++x) {
        int hits = 0;
        for (int i = 0; i < kRays * kRays; ++i) {
          const Ray ray = camera.ray(x + (i % kRays + 0.5) / kRays, y + (i / kRays + 0.5) / kRays);
          const std::optional<double> depth = hit(ray);
          const std::array<float, 3> color = depth        ? color_at(ray.origin + *depth * ray.direction)
                                             : background ? *background
                                                          : sphere_color(ray);
          for (int c = 0; c < 3; ++c) photo.rgb.pixel(x, y)[c] += color[c] / (kRays * kRays);
          hits += depth.has_value();
        }
        if (mask) photo.foreground.at(x, y) = static_cast<std::uint8_t>(255 * hits / (kRays * kRays));
      }
    return photo;
  }

 private:
  /// A colour for each unit cell.
  static std::array<float, 3> patch_color(const Eigen::Array3d& x) {
    const Eigen::Array3i patch = x.floor().cast<int>();
    std::uint32_t hash = 2166136261u;
    for (int a = 0; a < 3; ++a) hash = (hash ^ static_cast<std::uint32_t>(patch[a] + 17 * a)) * 16777619u;
    hash ^= hash >> 13;
    hash *= 2654435769u;
    std::array<float, 3> color;
    for (int c = 0; c < 3; ++c) color[c] = 0.05f + 0.9f * static_cast<float>(hash >> (8 * c) & 255) / 255;
    return color;
  }
};

inline PinholeCamera camera_looking_at_origin(const Eigen::Vector3d& centre, int size, double focal_px) {
  const Eigen::Vector3d z = -centre.normalized(), up(0.05, 0.1, 1);
  const Eigen::Vector3d x = z.cross(up).normalized();
  PinholeCamera camera;
  camera.pose.rotation.row(0) = x;
  camera.pose.rotation.row(1) = z.cross(x);
  camera.pose.rotation.row(2) = z;
  camera.pose.centre = centre;
  camera.intrinsics = {size, size, focal_px, focal_px, 0.5 * size, 0.5 * size, 0};
  return camera;
}

/// `count` views of `size` x `size` pixels at distance 3, half of them from above, half from below.
inline Dataset cube_dataset(int count, int size) {
  Dataset dataset;
  dataset.path = "cube";
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * M_PI * i / count;
    View view;
    view.name = "view" + std::to_string(i);
    const Eigen::Vector3d towards(std::cos(angle), std::sin(angle), i % 2 ? 0.7 : -0.5);
    view.camera = camera_looking_at_origin(3 * towards.normalized(), size, 1.5 * size);
    view.lens.intrinsics = view.camera.intrinsics;
    dataset.views.push_back(view);
  }
  assign_nodes(dataset);
  return dataset;
}

/// Without a background colour, the sphere is seen; `radiance` is what display white stands for.
inline PhotographLoader cube_loader(
    const std::optional<std::array<float, 3>>& background = std::array<float, 3>{0, 0, 0}, bool mask = false,
    float radiance = 1) {
  return [=](const View& view) {
    Photograph photo = CubeWorld::photograph(view.camera, background, mask);
    for (float& value : photo.rgb.data()) value *= radiance;
    return photo;
  };
}

/// What the views' exposures and white balances are: up to a factor of about two apart.
inline std::array<float, 3> true_light(int view) {
  const float exposure = std::exp2(std::sin(2.4f * static_cast<float>(view)) / 2);
  const float tint = 1 + 0.2f * std::sin(1.7f * static_cast<float>(view) + 1);
  return {exposure * tint, exposure, exposure / tint};
}

/// Photographs of the cube with masks, each in its own light.
inline PhotographLoader lit_loader(const Dataset& dataset) {
  return [&dataset](const View& view) {
    Photograph photo = CubeWorld::photograph(view.camera, std::array<float, 3>{0, 0, 0}, true);
    const std::array<float, 3> light = true_light(static_cast<int>(&view - dataset.views.data()));
    for (std::size_t i = 0; i < photo.rgb.data().size(); ++i) photo.rgb.data()[i] *= 0.4f * light[i % 3];
    return photo;
  };
}

}  // namespace roxel::fixture

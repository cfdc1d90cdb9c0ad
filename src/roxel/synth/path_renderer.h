#pragma once
/// Photographs of triangle meshes with diffuse materials by path tracing, and the truth about each pixel.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "roxel/base/run_context.h"
#include "roxel/camera/camera.h"
#include "roxel/image/image.h"
#include "roxel/synth/environment.h"
#include "roxel/synth/ray_scene.h"
#include "roxel/synth/sky_sampler.h"
#include "roxel/synth/texture.h"

namespace roxel {

/// Depth, albedo and normal are those of what stands for good along the ray through the pixel's centre.
struct Picture {
  Image rgb;       ///< linear radiance, averaged over the pixel's samples
  Image depth;     ///< one channel: distance along the optical axis, 0 = no surface
  Image albedo;    ///< 0 where there is no surface
  Image normal;    ///< in world coordinates, towards the camera; 0 where there is no surface
  Mask mask;       ///< share of the pixel's samples that met a surface, 0 to 255
  Mask transient;  ///< share of the pixel's samples that met what stands here for a while
};

/// An opening in a horizontal plane that nearly all light of the sky comes through. It is looked for straight
/// away, which leaves less grain than waiting for paths to find it.
struct Skylight {
  Eigen::AlignedBox2f extent;
  float height;
};

struct PathOptions {
  int samples = 16;  ///< rays a pixel, at least 1
  int bounces = 2;   ///< diffuse reflections of light that is not the sun's or sky's own, at least 0
  bool environment_seen = true;  ///< whether cameras see the sky; black otherwise
  /// Light of the sky and of other surfaces is smoothed along each surface in so many passes
  /// (light_filter.h). The sun's own light and its shadows are not.
  int smoothing = 3;
  std::optional<Skylight> skylight = {};
  std::uint32_t seed = 1;
};

class PathRenderer {
 public:
  /// `everything` is what light meets, `lasting` what depth is taken from; they may be one. All arguments
  /// must outlive the renderer.
  PathRenderer(const RayScene& everything, const RayScene& lasting, const std::vector<Texture>& materials,
               const Environment& environment, const PathOptions& options);

  /// On the calling thread; throws Cancelled within a row of pixels. `image` seeds the samples.
  Picture render(const PinholeCamera& camera, int image, const RunContext& context) const;

 private:
  struct PixelSamples;
  struct PixelLight;
  PixelLight light_of_pixel(const PinholeCamera& camera, int x, int y, PixelSamples& samples) const;
  std::optional<RayHit> measure_pixel(const PinholeCamera& camera, int x, int y, Picture& picture) const;
  Eigen::Vector3f incoming(Eigen::Vector3f from, RayHit hit, int k, PixelSamples& samples) const;
  Eigen::Vector3f sunlight(const Eigen::Vector3f& p, const Eigen::Vector3f& normal,
                           const Eigen::Vector2f& random) const;
  Eigen::Vector3f skylight(const Eigen::Vector3f& p, const Eigen::Vector3f& normal,
                           const Eigen::Vector2f& random) const;
  Eigen::Vector3f sky_found(const Eigen::Vector3f& p, const Eigen::Vector3f& direction, float facing) const;
  float opening_density(const Eigen::Vector3f& p, const Eigen::Vector3f& direction) const;
  Eigen::Vector3f light_from_above(const Eigen::Vector3f& p, const Eigen::Vector3f& normal,
                                   const Eigen::Vector2f& random) const;

  const RayScene& everything_;
  const RayScene& lasting_;
  const std::vector<Texture>& materials_;
  const Environment& environment_;
  PathOptions options_;
  SkySampler sampler_;
  enum class SkySearch { kByChance, kBrightParts, kOpening } search_;  ///< how paths find the sky
  Eigen::Vector3f sun_u_, sun_v_;                                      ///< across the direction to the sun
};

}  // namespace roxel

#pragma once
/// Photographs of the demo world by sphere tracing: diffuse surfaces under a sun and a sky that never change,
/// so that a surface point has one colour in every image.

#include <Eigen/Core>
#include <optional>

#include "roxel/base/run_context.h"
#include "roxel/camera/camera.h"
#include "roxel/image/image.h"
#include "roxel/synth/demo_scene.h"

namespace roxel {

enum class DemoBackground { kBlack, kSky };

/// A photograph and the truth about it.
struct DemoPicture {
  Image rgb;    ///< linear RGB; averaged over the pixel's samples
  Image depth;  ///< one channel: distance along the optical axis through the pixel's centre, 0 = no surface
  Mask mask;    ///< share of the pixel's samples that met a surface, 0 to 255
};

class DemoRenderer {
 public:
  /// `samples_per_axis`^2 rays a pixel on a regular grid, at least 1. The scene must outlive the renderer.
  DemoRenderer(const DemoScene& scene, DemoBackground background, int samples_per_axis);

  /// On the calling thread; throws Cancelled within a row of pixels.
  DemoPicture render(const PinholeCamera& camera, const RunContext& context) const;

  /// Distance from `origin` along the unit vector `direction` to the first surface between `begin`
  /// and `limit`. Exact to about 2e-4 world units.
  std::optional<float> trace(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float begin,
                             float limit) const;
  /// Linear RGB of the surface at `p`, seen from anywhere.
  Eigen::Vector3f shade(const Eigen::Vector3f& p) const;
  /// Whether nothing stands between a surface point and a camera's centre.
  bool visible(const Eigen::Vector3f& p, const Eigen::Vector3f& centre) const;

 private:
  struct Tile;
  void render_tile(const PinholeCamera& camera, const Tile& tile, DemoPicture& picture) const;
  float clear_distance(const PinholeCamera& camera, const Tile& tile) const;
  Eigen::Vector3f sky(const Eigen::Vector3f& direction) const;
  float sunlight(const Eigen::Vector3f& p) const;
  float openness(const Eigen::Vector3f& p, const Eigen::Vector3f& normal) const;

  const DemoScene& scene_;
  DemoBackground background_;
  int samples_per_axis_;
};

}  // namespace roxel

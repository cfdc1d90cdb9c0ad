#pragma once
/// The volume as a camera sees it: I = sum of r_s c_s + r_bg c_bg with r_s = a_s T_s (docs/rays.md).

#include <array>
#include <vector>

#include "roxel/base/run_context.h"
#include "roxel/image/image.h"
#include "roxel/march/ray_walk.h"

namespace roxel {

struct RenderOptions {
  std::array<float, 3> background = {0, 0, 0};  ///< linear RGB, where rays leave the volume
  bool surround = true;                         ///< lattices around the box are seen, too
};

struct Rendering {
  Image rgb;      ///< linear, 3 channels
  Image depth;    ///< mean distance along the optical axis of what the rays end in, world units; 0 = nothing
  Image opacity;  ///< 1 - r_bg, over the box's voxels alone
};

/// What one pixel shows, from its ray's voxels in ray order.
class RenderedRay {
 public:
  /// A voxel of opacity a (over its chord) whose chord's middle is at `depth`.
  void add(float a, const std::array<float, 3>& color, float depth, bool in_box) {
    const float r = a * transmittance_;
    for (int c = 0; c < 3; ++c) rgb_[c] += r * color[c];
    if (in_box) {
      opacity_ += r;
      depth_ += r * depth;
    }
    transmittance_ *= 1 - a;
  }
  /// Whether what lies behind cannot be seen.
  bool spent() const { return transmittance_ <= kSpent; }
  void write(const RenderOptions& options, int x, int y, Rendering& out) const;

 private:
  static constexpr float kSpent = 1e-4f;  ///< below what 12 bits of colour resolve
  float rgb_[3] = {0, 0, 0};
  float depth_ = 0;
  float opacity_ = 0;
  float transmittance_ = 1;
};

/// Looks along single rays.
class RayRenderer {
 public:
  /// `colors`: linear RGB, one entry a slot. Keeps references.
  RayRenderer(const LatticeStack& stack, const std::vector<std::array<float, 3>>& colors,
              const RenderOptions& options)
      : stack_(stack), colors_(colors), options_(options) {}
  /// Between the depths of `range`, cut to `sight` unless null (see walk_lattices).
  RenderedRay look(const Ray& ray, Stretch range, const Stretch* sight);

 private:
  const LatticeStack& stack_;
  const std::vector<std::array<float, 3>>& colors_;
  const RenderOptions& options_;
  StepChunk chunk_;
};

/// One ray through each pixel's centre, between the depths of `range`; `colors` is linear RGB, one entry a
/// slot.
Rendering render(const LatticeStack& stack, const std::vector<std::array<float, 3>>& colors,
                 const PinholeCamera& camera, Stretch range, const RenderOptions& options,
                 const RunContext& context);

}  // namespace roxel

#pragma once
/// The volume as a camera sees it: I = sum of r_s c_s + r_bg c_bg with r_s = a_s T_s, a mean over the rays of
/// a pixel (docs/rays.md).

#include <array>
#include <vector>

#include "roxel/base/run_context.h"
#include "roxel/image/image.h"
#include "roxel/march/voxel_blend.h"

namespace roxel {

struct RenderOptions {
  std::array<float, 3> background = {0, 0, 0};  ///< linear RGB, where rays leave the volume
  bool surround = true;                         ///< lattices around the box are seen, too
  bool interpolate = false;                     ///< colours between voxels' centres are interpolated
};

struct Rendering {
  Image rgb;      ///< linear, 3 channels
  Image depth;    ///< mean distance along the optical axis of what the rays end in, world units; 0 = nothing
  Image opacity;  ///< 1 - r_bg, over the box's voxels alone
};

/// What one ray shows, from its voxels in ray order; or the mean of several.
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
  static RenderedRay mean(const RenderedRay* rays, int count);
  void write(const RenderOptions& options, int x, int y, Rendering& out) const;

  /// Transmittance behind which nothing can be seen: below what 12 bits of colour resolve.
  static constexpr float kSpent = 1e-4f;

 private:
  float rgb_[3] = {0, 0, 0};
  float depth_ = 0;
  float opacity_ = 0;
  float transmittance_ = 1;
};

/// Where the rays of a pixel are that see voxels no coarser than it: through its middle, or one through the
/// middle of each quarter where rays would otherwise be more than half a voxel apart.
class SubpixelRays {
 public:
  static constexpr int kMost = 4;
  SubpixelRays(const LatticeFrame& box, const PinholeCamera& camera);
  int count() const { return side_ * side_; }
  /// Pixel position of ray i of the pixel at (x, y).
  double u(int x, int i) const { return x + (i % side_ + 0.5) / side_; }
  double v(int y, int i) const { return y + (i / side_ + 0.5) / side_; }
  /// Side of a pixel in voxels of the box, at the box's middle.
  double pixel_in_voxels() const { return pixel_; }

 private:
  double pixel_;
  int side_;
};

/// Opacity of each of the chunk's voxels over its chord. `opacities` has room for StepChunk::kSize.
void chord_opacities(const std::vector<float>& tau, const StepChunk& steps, float* opacities);

/// Calls visit(steps, i, a, r) for what a ray sees: voxel i of the chunk, its opacity a over its chord, and
/// its share r = a T of the ray.
template <class Visit>
void for_each_share(const LatticeStack& stack, const RenderOptions& options, const Ray& ray, Stretch range,
                    const Stretch* sight, StepChunk& chunk, Visit&& visit) {
  float transmittance = 1;
  std::array<float, StepChunk::kSize> opacities;
  const auto nothing = [](std::uint32_t) {};
  stack.walk_chunks(ray, range, sight, chunk, nothing, [&](const StepChunk& steps) {
    if (steps.lattice > 0 && !options.surround) return true;
    chord_opacities(stack.volume().tau, steps, opacities.data());
    for (int i = 0; i < steps.count && transmittance > RenderedRay::kSpent; ++i) {
      if (!(opacities[i] > 0)) continue;
      visit(steps, i, opacities[i], opacities[i] * transmittance);
      transmittance *= 1 - opacities[i];
    }
    return transmittance > RenderedRay::kSpent;
  });
}

/// The voxels whose colours a share of a ray shows: those around the chord's middle, or where they are not
/// interpolated, or the share is too small to matter, the voxel itself.
inline VoxelBlend blend_of(const LatticeStack& stack, const RenderOptions& options, const StepChunk& steps,
                           int i, const Ray& ray, float share) {
  constexpr float kNoticed = 0.01f;
  if (!options.interpolate || share < kNoticed) return {1, {steps.slot[i]}, {1.0f}};
  const BrickIndex& index = stack.volume().index(steps.lattice);
  return blend_around(index, in_voxels(index.frame(), ray, steps.depth(i)));
}

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

/// SubpixelRays through each pixel, between the depths of `range`; `colors` is linear RGB, one entry a slot.
Rendering render(const LatticeStack& stack, const std::vector<std::array<float, 3>>& colors,
                 const PinholeCamera& camera, Stretch range, const RenderOptions& options,
                 const RunContext& context);

}  // namespace roxel

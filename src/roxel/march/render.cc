#include "roxel/march/render.h"

#include <algorithm>

#include "roxel/base/fast_exp.h"
#include "roxel/base/kernel.h"
#include "roxel/base/parallel.h"
#include "roxel/march/brick_sight.h"

namespace roxel {

namespace {

ROXEL_KERNEL void opacities_of(const float* tau, const std::uint32_t* slots, const float* lengths, int count,
                               float* __restrict opacities) {
  for (int i = 0; i < count; ++i) opacities[i] = one_minus_exp(tau[slots[i]] * lengths[i]);
}

}  // namespace

void chord_opacities(const std::vector<float>& tau, const StepChunk& steps, float* opacities) {
  constexpr int kWhole = StepChunk::kLanes;  // behind the count, slots are good ones
  opacities_of(tau.data(), steps.slot, steps.length, (steps.count + kWhole - 1) / kWhole * kWhole, opacities);
}

void RenderedRay::write(const RenderOptions& options, int x, int y, Rendering& out) const {
  for (int c = 0; c < 3; ++c) out.rgb.pixel(x, y)[c] = rgb_[c] + transmittance_ * options.background[c];
  *out.opacity.pixel(x, y) = opacity_;
  *out.depth.pixel(x, y) = opacity_ > 1e-3f ? depth_ / opacity_ : 0.0f;
}

RenderedRay RenderedRay::mean(const RenderedRay* rays, int count) {
  if (count == 1) return *rays;
  RenderedRay mean;
  mean.transmittance_ = 0;
  const float share = 1.0f / static_cast<float>(count);
  for (int i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) mean.rgb_[c] += share * rays[i].rgb_[c];
    mean.depth_ += share * rays[i].depth_;
    mean.opacity_ += share * rays[i].opacity_;
    mean.transmittance_ += share * rays[i].transmittance_;
  }
  return mean;
}

SubpixelRays::SubpixelRays(const LatticeFrame& box, const PinholeCamera& camera) {
  constexpr double kApart = 0.5;  // voxels
  // A camera inside looks at what is half a box away.
  const Eigen::Vector3d to_middle = box.box().center() - camera.pose.centre;
  const double away = std::max(to_middle.norm(), 0.25 * box.box().diagonal().norm());
  pixel_ = away / (camera.intrinsics.fx * box.voxel_size);
  side_ = pixel_ > kApart ? 2 : 1;
}

RenderedRay RayRenderer::look(const Ray& ray, Stretch range, const Stretch* sight) {
  RenderedRay seen;
  for_each_share(stack_, options_, ray, range, sight, chunk_,
                 [&](const StepChunk& steps, int i, float a, float share) {
                   const VoxelBlend blend = blend_of(stack_, options_, steps, i, ray, share);
                   std::array<float, 3> color{0, 0, 0};
                   for (int k = 0; k < blend.count; ++k)
                     for (int c = 0; c < 3; ++c) color[c] += blend.weight[k] * colors_[blend.slot[k]][c];
                   seen.add(a, color, steps.depth(i), steps.lattice == 0);
                 });
  return seen;
}

Rendering render(const LatticeStack& stack, const std::vector<std::array<float, 3>>& colors,
                 const PinholeCamera& camera, Stretch range, const RenderOptions& options,
                 const RunContext& context) {
  const int width = camera.intrinsics.width, height = camera.intrinsics.height;
  Rendering out{Image(width, height, 3), Image(width, height, 1), Image(width, height, 1)};
  const BrickSight sight(stack, camera);
  const SubpixelRays rays(stack.volume().index(0).frame(), camera);
  parallel_for(height, context.thread_count(), [&](std::int64_t row, int) {
    context.throw_if_cancelled();
    const int y = static_cast<int>(row);
    RayRenderer renderer(stack, colors, options);
    std::array<RenderedRay, SubpixelRays::kMost> seen;
    for (int x = 0; x < width; ++x) {
      for (int i = 0; i < rays.count(); ++i) {
        const double u = rays.u(x, i), v = rays.v(y, i);
        seen[i] = renderer.look(camera.ray(u, v), range, sight.at(u, v));
      }
      RenderedRay::mean(seen.data(), rays.count()).write(options, x, y, out);
    }
  });
  return out;
}

}  // namespace roxel

#include "roxel/march/render.h"

#include "roxel/base/fast_exp.h"
#include "roxel/base/parallel.h"
#include "roxel/march/brick_sight.h"

namespace roxel {

void RenderedRay::write(const RenderOptions& options, int x, int y, Rendering& out) const {
  for (int c = 0; c < 3; ++c) out.rgb.pixel(x, y)[c] = rgb_[c] + transmittance_ * options.background[c];
  *out.opacity.pixel(x, y) = opacity_;
  *out.depth.pixel(x, y) = opacity_ > 1e-3f ? depth_ / opacity_ : 0.0f;
}

RenderedRay RayRenderer::look(const Ray& ray, Stretch range, const Stretch* sight) {
  RenderedRay seen;
  const std::vector<float>& tau = stack_.volume().tau;
  const auto nothing = [](std::uint32_t) {};
  stack_.walk_chunks(ray, range, sight, chunk_, nothing, [&](const StepChunk& steps) {
    if (steps.lattice > 0 && !options_.surround) return true;
    for (int i = 0; i < steps.count && !seen.spent(); ++i) {
      const std::uint32_t slot = steps.slot[i];
      seen.add(one_minus_exp(tau[slot] * steps.length[i]), colors_[slot], steps.depth(i), steps.lattice == 0);
    }
    return !seen.spent();
  });
  return seen;
}

Rendering render(const LatticeStack& stack, const std::vector<std::array<float, 3>>& colors,
                 const PinholeCamera& camera, Stretch range, const RenderOptions& options,
                 const RunContext& context) {
  const int width = camera.intrinsics.width, height = camera.intrinsics.height;
  Rendering out{Image(width, height, 3), Image(width, height, 1), Image(width, height, 1)};
  const BrickSight sight(stack, camera);
  parallel_for(height, context.thread_count(), [&](std::int64_t row, int) {
    context.throw_if_cancelled();
    const int y = static_cast<int>(row);
    RayRenderer renderer(stack, colors, options);
    for (int x = 0; x < width; ++x) {
      const double u = x + 0.5, v = y + 0.5;
      renderer.look(camera.ray(u, v), range, sight.at(u, v)).write(options, x, y, out);
    }
  });
  return out;
}

}  // namespace roxel

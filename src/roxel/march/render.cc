#include "roxel/march/render.h"

#include <cmath>

#include "roxel/base/parallel.h"
#include "roxel/march/brick_sight.h"

namespace roxel {

namespace {

constexpr float kSpent = 1e-4f;  ///< transmittance at which a ray ends: below what 12 bits of colour resolve

struct SeenAlongRay {
  float rgb[3] = {0, 0, 0};
  float depth = 0;
  float opacity = 0;
  float transmittance = 1;
};

SeenAlongRay look(const LatticeStack& stack, const std::vector<std::array<float, 3>>& colors, const Ray& ray,
                  Stretch range, const Stretch* sight, bool surround, StepChunk& chunk) {
  SeenAlongRay seen;
  const std::vector<float>& tau = stack.volume().tau;
  const auto nothing = [](std::uint32_t) {};
  stack.walk_chunks(ray, range, sight, chunk, nothing, [&](const StepChunk& steps) {
    if (steps.lattice > 0 && !surround) return true;
    for (int i = 0; i < steps.count; ++i) {
      const std::uint32_t slot = steps.slot[i];
      const float a = 1 - std::exp(-tau[slot] * steps.length[i]);
      const float r = a * seen.transmittance;
      for (int c = 0; c < 3; ++c) seen.rgb[c] += r * colors[slot][c];
      if (steps.lattice == 0) {
        seen.opacity += r;
        seen.depth += r * steps.depth(i);
      }
      seen.transmittance *= 1 - a;
      if (seen.transmittance <= kSpent) return false;
    }
    return true;
  });
  return seen;
}

}  // namespace

Rendering render(const LatticeStack& stack, const std::vector<std::array<float, 3>>& colors,
                 const PinholeCamera& camera, Stretch range, const RenderOptions& options,
                 const RunContext& context) {
  const int width = camera.intrinsics.width, height = camera.intrinsics.height;
  Rendering out{Image(width, height, 3), Image(width, height, 1), Image(width, height, 1)};
  const BrickSight sight(stack, camera);
  parallel_for(height, context.thread_count(), [&](std::int64_t row, int) {
    context.throw_if_cancelled();
    const int y = static_cast<int>(row);
    StepChunk chunk;
    for (int x = 0; x < width; ++x) {
      const double u = x + 0.5, v = y + 0.5;
      const SeenAlongRay seen =
          look(stack, colors, camera.ray(u, v), range, sight.at(u, v), options.surround, chunk);
      for (int c = 0; c < 3; ++c)
        out.rgb.pixel(x, y)[c] = seen.rgb[c] + seen.transmittance * options.background[c];
      *out.opacity.pixel(x, y) = seen.opacity;
      *out.depth.pixel(x, y) = seen.opacity > 1e-3f ? seen.depth / seen.opacity : 0.0f;
    }
  });
  return out;
}

}  // namespace roxel

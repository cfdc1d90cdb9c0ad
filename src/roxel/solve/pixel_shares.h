#pragma once
/// What pixels of photographs show of a volume: each voxel's share of each pixel, as the renderer has it.

#include <array>
#include <atomic>
#include <functional>
#include <span>

#include "roxel/march/brick_sight.h"
#include "roxel/march/render.h"
#include "roxel/solve/scene.h"
#include "roxel/solve/surface_light.h"

namespace roxel {

/// Shares of one pixel, in units of kShareUnit.
struct PixelShares {
  std::span<const std::uint32_t> slots;
  std::span<const std::uint16_t> shares;
};
inline constexpr float kShareUnit = 1.0f / 65535;

/// One pixel of a photograph that is looked at.
struct FitPixel {
  std::uint32_t at;                   ///< x + width y
  std::array<Eigen::half, 3> target;  ///< canonical linear RGB
  std::array<Eigen::half, 3> weight;  ///< of its squared error, so that it counts as a display shows it

  /// Counts it so much less; 0: not at all.
  void believe(float trust);
  bool is_believed() const { return static_cast<float>(weight[0]) > 0; }
};

/// Slope of the sRGB curve at linear light, 1 = white: by it, small errors count as a display shows them.
float display_slope(float light);

/// Pixels of all photographs: a third of a voxel apart, or all where they are wider; farther apart where
/// there would be more than three for each voxel (or 2^22, if that is more), or than 2^24.
class FitPixels {
 public:
  /// Of the views' valid pixels, those that are object where there are masks. Of `kept_bytes`, what pixels
  /// themselves leave is for shares; those that do not fit are found each time anew: results do not depend on
  /// it. References are kept.
  FitPixels(const Dataset& dataset, const PhotographLoader& load, const Scene& scene,
            const SurfaceLight* surface_light, const LatticeStack& stack, double kept_bytes,
            const RunContext& context);

  /// Pixels are worked on in so many parts.
  std::size_t part_count() const { return parts_.size(); }

  /// Calls visit(part, pixel, shares) for all pixels that are believed, from several threads at once, but for
  /// those of one part in their order.
  void for_each(
      const std::function<void(std::size_t part, FitPixel& pixel, const PixelShares& shares)>& visit);

 private:
  class Finder;
  struct View {
    PinholeCamera camera;
    Stretch range;
    BrickSight sight;
    SubpixelRays rays;
    std::vector<FitPixel> pixels;
  };
  struct Part {
    std::size_t view, begin, end;
    bool kept = false;
    std::vector<std::uint32_t> ends = {};  ///< of each pixel's shares, once they are kept
    std::vector<std::uint32_t> slots = {};
    std::vector<std::uint16_t> shares = {};
  };

  double common_distance() const;
  static int stride_of(const View& view, double apart);
  void choose(const Dataset& dataset, const PhotographLoader& load, const Scene& scene,
              const SurfaceLight* surface_light, int view_idx, double apart);

  const LatticeStack& stack_;
  const RunContext& context_;
  std::vector<View> views_;
  std::vector<Part> parts_;
  std::atomic<std::int64_t> room_;  ///< bytes
};

}  // namespace roxel

#pragma once
/// How well a plane, put where a pixel looks, explains that several photographs show the same there:
/// normalised cross-correlation over slanted patches, and its least-squares refinement ([Gruen85];
/// docs/depth.md).

#include <array>
#include <vector>

#include "roxel/camera/camera.h"
#include "roxel/depth/pixel_plane.h"
#include "roxel/image/image.h"

namespace roxel {

/// What patches compare: one channel whose steps look alike in light and shade. NaN where nothing is known.
Image matching_luma(const Image& rgb, double white, const Mask& valid);

/// The same for each of three channels: what tells surfaces apart.
Image matching_color(const Image& rgb, double white);

/// From a pixel (u, v) of the reference and its inverse depth w to another view: h = from_pixel (u, v, 1) + w
/// parallax, position h.xy / h.z.
struct PatchWarp {
  PatchWarp(const PinholeCamera& reference, const PinholeCamera& source);
  Eigen::Matrix3d from_pixel;
  Eigen::Vector3d parallax;
};

/// A view that patches are looked for in.
struct PatchSource {
  const Image* luma = nullptr;
  PatchWarp warp;
};

struct PatchOptions {
  int radius = 3;        ///< pixels
  double noise = 0.006;  ///< deviation of the luma that is always granted
  double gap = 1;        ///< depth between a pixel and the plane that makes it another surface, world units
};

/// The patch of one pixel in the reference, ready to be compared. Samples are weighted by likeness in colour
/// (a patch should show one surface) and by distance; those off the surface count 0.
class Patch {
 public:
  static constexpr int kMostRadius = 7;
  static constexpr int kMostSamples = 232;  ///< (2 kMostRadius + 1)^2, up to whole groups of eight

  /// `color`: of the same size as `luma`, or empty; then likeness is that of luma. `surface`: planes that
  /// pixels are taken to lie on; those that are off the patch's own, or have none, are not part of it.
  Patch(const Image& luma, const Image& color, const PlaneMap& surface, int x, int y,
        const PatchOptions& options);

  /// Whether there is enough to compare.
  bool usable() const { return usable_; }
  double variance() const { return variance_; }
  double sample_count() const { return sample_count_; }
  /// A homography's numerators and denominator about the patch's middle.
  struct Steps {
    float x0, xu, xv, y0, yu, yv, z0, zu, zv;
  };
  /// Where the plane puts the patch in `source`; whether that is inside the image.
  bool place(const PatchSource& source, const PixelPlane& plane, Steps& steps) const;

  /// Correlation in [-1, 1] with `source` at a place inside it. Noise counts as texture that does not
  /// correlate.
  float correlation(const PatchSource& source, const Steps& steps) const;
  /// The same under the plane; NaN where the patch leaves the image.
  float correlation(const PatchSource& source, const PixelPlane& plane) const;

  /// Normal equations of the plane's three numbers from one view: gain and offset of light are solved for.
  struct Equations {
    std::array<double, 6> a{};  ///< ww, wu, wv, uu, uv, vv of J^T J
    std::array<double, 3> b{};  ///< J^T residual
    double residual = 0;        ///< mean square, in units of luma squared
    double gain = 0;            ///< light of the reference / light of the source
    bool valid = false;
  };
  Equations linearise(const PatchSource& source, const PixelPlane& plane) const;

 private:
  int u_, v_;
  int radius_;
  int count_ = 0;
  double noise_variance_;
  double variance_ = 0;
  double sample_count_ = 0;
  bool usable_ = false;
  alignas(32) std::array<float, kMostSamples> du_, dv_, weight_, value_;  ///< value: mean 0
};

}  // namespace roxel

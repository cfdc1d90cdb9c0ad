#pragma once
/// The light that is divided out of the photographs before they are compared and before voxels are painted
/// (docs/light.md; [Jethwa04] section 7.2.3).

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "roxel/dataset/dataset.h"

namespace roxel {

enum class IlluminationChoice { kAuto, kNone, kGain, kSky, kSkyNormal };
enum class Matching { kAuto, kCanonical, kLocal };

/// Where a view's light comes from.
enum class LightSource {
  kNone,  ///< it counts as 1
  kGain,  ///< it follows the volume from pass to pass
  kSky,   ///< it is that of the dome, where that is known; else a gain
};

/// A photograph's radiance is canonical colour times exposure times the view's light, per channel.
struct Light {
  std::vector<std::array<float, 3>> of_views;  ///< one a view; empty: 1 for all
  LightSource from = LightSource::kNone;
  std::vector<std::uint8_t> of_dome;  ///< kSky: one a view, 1 where its light is that of its dome
  std::vector<int> shared;            ///< kSky: one a view; views of one number >= 0 are in one light
  bool by_normal = false;             ///< kSky: voxels are painted by the light on their own surface
  bool local_matching = false;        ///< colours are compared without their neighbourhood's light
  double blur_deg = 5;                ///< standard deviation of that neighbourhood

  std::array<float, 3> of_view(int view_idx) const {
    return of_views.empty() ? std::array<float, 3>{1, 1, 1} : of_views[view_idx];
  }
  /// Whether a view's light is a gain, which follows the volume from pass to pass.
  bool is_gain(int view_idx) const {
    return from == LightSource::kGain ||
           (from == LightSource::kSky && !of_dome.empty() && !of_dome[view_idx]);
  }
  bool has_gains() const {
    return from == LightSource::kGain ||
           (from == LightSource::kSky && std::find(of_dome.begin(), of_dome.end(), 0) != of_dome.end());
  }
};

/// Linear RGB under canonical light; 1 = white at `exposure` (radiance units).
Image canonical_image(const Photograph& photo, int view_idx, double exposure, const Light& light);

/// What the view is compared by, linear RGB: the canonical image, or that without local light. `focal_px` is
/// the camera's.
Image matching_image(const Photograph& photo, int view_idx, double focal_px, double exposure,
                     const Light& light);

}  // namespace roxel

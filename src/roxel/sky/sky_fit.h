#pragma once
/// From a node's pictures to its light: facets, masks, sun, model, and again with the facets that agree
/// ([Jethwa04] ch. 3).

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "roxel/sky/node_sky.h"
#include "roxel/sky/sky_masks.h"
#include "roxel/sky/sky_picture.h"
#include "roxel/sky/sphere_light.h"

namespace roxel {

struct SkyFitOptions {
  int facet_level = 6;  ///< of the sphere, 4 to 8: 1.7 degrees at 6
  SkyMaskOptions masks;
  bool free_exponent = true;       ///< fit h, too; else it is 1
  int residual_order = 0;          ///< of spherical functions on top of the model, 0 (none) to 4
  int most_rounds = 8;             ///< fits, each with the facets that agree with the one before
  std::optional<SunPosition> sun;  ///< by hand
};

/// One node: what is known of it apart from its pictures.
struct SkyTask {
  std::string name;
  std::vector<std::string> views;        ///< one a picture
  std::vector<Eigen::Vector3d> centres;  ///< of their cameras, world; may be empty
  std::optional<double> time_utc_s, latitude_deg, longitude_deg;
  Eigen::Matrix3d sky_from_world = Eigen::Matrix3d::Identity();
};

/// The picture of a view, by its place in SkyTask::views. May be asked for the same one twice.
using SkyPictureSource = std::function<SkyPicture(int)>;

/// The result, and how it came about.
struct SkyFit {
  NodeSky sky;
  SphereLight light;
  SkyMasks masks;
  /// The sky as fitted to what does not clip: masks come from it. Differs from `sky` where most of it clips,
  /// so that its light is not known.
  NodeSky fitted;
  std::vector<std::uint8_t> used;  ///< facets of the last fit
  /// Facets that are sky, but clip for more than a tenth. 1 = such a one.
  std::vector<std::uint8_t> clipped_sky;
  /// Facets that are sky though the model does not agree with them, clouds: neutral, bright, next to the
  /// others, and a volume knows of nothing there. 1 = such a one.
  std::vector<std::uint8_t> beyond_model;
  double pixels_per_facet = 0;  ///< of the fit, on average: below two, facets are finer than what is seen
  int rounds = 0;
  bool settled = false;  ///< the last round changed no facet
  std::vector<std::string> warnings;
};

/// Never throws for what pictures show: what cannot be had is a named fallback (NodeSky::fallback).
/// Deterministic.
SkyFit fit_sky(const SkyTask& task, const SkyPictureSource& pictures, const SkyFitOptions& options);

/// How surely each pixel shows the sky, 0 to 255: agreement with the model where the picture, pixel by pixel,
/// hangs together with facets that the fit used. Where the sky clips, what clips; all 0 without a model
/// and clipped sky.
Mask soft_sky_mask(const SkyPicture& picture, const SkyFit& fit);

}  // namespace roxel

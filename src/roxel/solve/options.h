#pragma once
/// Everything a user may choose about a reconstruction. Each field's name on the command line, range, unit
/// and source stand once, in reconstruct_option_table().

#include <array>
#include <optional>
#include <string>

#include "roxel/base/option_table.h"
#include "roxel/color/color_space.h"
#include "roxel/infer/passes.h"
#include "roxel/solve/daylight.h"
#include "roxel/solve/light.h"

namespace roxel {

enum class BackgroundChoice { kAuto, kNone, kUnknown, kBlack, kConstant, kMask, kSky };
enum class SurroundChoice { kAuto, kOn, kOff };

struct ReconstructOptions {
  // What is reconstructed, and how finely
  std::optional<std::array<double, 6>> bounds;  ///< x0, y0, z0, x1, y1, z1
  std::optional<double> near;
  std::optional<double> far;
  std::optional<double> voxel_size;  ///< of the finest level; otherwise from `resolution`
  int resolution = 256;              ///< voxels along the longest side, at the finest level
  int levels = 3;
  int passes = 8;         ///< of the last level, at most; see most_passes
  int coarse_passes = 0;  ///< of each level before the last, at most; 0: see most_passes
  int draft_passes = 3;   ///< of each level's, less one at most
  double tolerance = 1e-4;
  bool all_passes = false;
  SurroundChoice surround = SurroundChoice::kAuto;
  double min_overlap = 0.4;
  std::optional<double> memory;  ///< GiB that the process may hold; changes no result

  // How images are sampled
  bool adaptive = true;
  double samples_per_voxel = 1;
  bool interpolate = false;
  double observation_weight = 1;
  double outline_weight = 0;  ///< of pixels that an object's outline halves, 0 to 1

  // Colour and its agreement
  ColorSpace color_space = ColorSpace::kLuv;
  std::string white_point = "D65";
  std::optional<double> noise;
  Agreement agreement = Agreement::kGaussian;
  std::optional<double> agreement_scale;
  double outlier = 1e-7;
  std::optional<double> uninformative;
  double evidence_half = 0.02;
  bool predictive = true;
  bool fit_colors = true;

  // Background
  BackgroundChoice background = BackgroundChoice::kAuto;
  std::optional<std::array<double, 3>> background_color;  ///< linear RGB
  bool filter_rays = false;
  bool filter_background = false;
  bool empty_sky = true;

  // Light
  IlluminationChoice illumination = IlluminationChoice::kAuto;
  DomeLight sky_light = DomeLight::kHorizontal;
  Matching matching = Matching::kAuto;
  double matching_blur = 5;  ///< degrees

  // Opacity
  UpdateRule update = UpdateRule::kPosterior;
  double spatial_prior = 0.99;
  double prior_sharpness = 5;
  double prior_strength = 1;
  double prior_opacity = 0.02;
  double acceleration = 12;
  bool ray_weights = false;
  double opacity_threshold = 0.04;
  double confidence_threshold = 0.001;
};

/// The one table that the command line, JSON, the summary and the docs are made from.
const OptionTable<ReconstructOptions>& reconstruct_option_table();

}  // namespace roxel

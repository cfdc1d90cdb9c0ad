#pragma once
/// The light of one capture node: sky and sun, as fitted to its pictures, and what that light is worth.
/// Directions and normals of the queries are in the data set's world.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "roxel/image/image.h"
#include "roxel/sky/perez.h"
#include "roxel/sky/sun_position.h"

namespace roxel {

/// How much of the model the pictures could decide.
enum class SkyModel {
  kNone,       ///< no sky in view, or night: there is no light to speak of, and no background
  kUniform,    ///< one colour all over
  kPublished,  ///< one of the published skies, scaled: too little of the dome is in view for more
  kGradation,  ///< from zenith to horizon alone: the sun is not known
  kPerez,      ///< all parameters
};
const char* to_string(SkyModel model);

/// NodeSky::fallback of a sky that is white all over.
inline constexpr const char* kClippedSky = "clipped";

/// Where the sun's direction comes from.
enum class SunSource { kNone, kTime, kImages, kGiven };
const char* to_string(SunSource source);

/// What is known of the disc's light.
enum class SunLight {
  kNone,       ///< it does not shine: overcast, or below the horizon
  kMeasured,   ///< summed over unclipped pixels
  kEstimated,  ///< from how clear the sky is: the disc is hidden, clipped or not in view
};
const char* to_string(SunLight light);

/// Whether a query counts the sun's disc.
enum class Disc { kWithout, kWith };

struct NodeSky {
  std::string name;                      ///< of the files: "n03"
  std::vector<std::string> views;        ///< whose pixels it was fitted to
  std::vector<Eigen::Vector3d> centres;  ///< of their cameras, world; empty where they are not known
  std::optional<double> time_utc_s, latitude_deg, longitude_deg;
  Eigen::Matrix3d sky_from_world = Eigen::Matrix3d::Identity();  ///< to X east, Y north, Z up

  SkyModel model = SkyModel::kNone;
  std::string fallback;                                      ///< why it is not kPerez; empty where it is
  std::array<PerezChannel, 3> channels;                      ///< red, green, blue
  int residual_order = 0;                                    ///< of spherical functions on top; 0 = none
  std::array<std::vector<double>, 3> residual;               ///< (order + 1)^2 coefficients of log radiance
  Eigen::Vector3d relative_sigma = Eigen::Vector3d::Zero();  ///< of seen / model over the facets used
  int clearness_bin = 0;                                     ///< nearest published sky, 0 overcast to 7 clear

  SunSource sun_source = SunSource::kNone;
  Eigen::Vector3d sun = Eigen::Vector3d::UnitZ();  ///< unit, sky frame; the zenith where it is not known
  std::optional<Eigen::Vector3d> sun_by_time;      ///< sky frame
  std::optional<Eigen::Vector3d> sun_by_images;    ///< sky frame
  SunLight sun_light = SunLight::kNone;
  Eigen::Vector3d sun_irradiance = Eigen::Vector3d::Zero();  ///< on a surface that faces the sun

  /// Standard deviation over mean of its luminance: of the estimate, or what images that measure it differ
  /// by.
  double sun_relative_sigma = 0;

  double mean_error = 0;     ///< mean of |model / seen - 1| over the facets used and channels
  double sky_share = 0;      ///< of the upper hemisphere: facets used
  double clipped_share = 0;  ///< of the upper hemisphere: facets that are sky but clip, the sun's left out
  double inlier_share = 0;   ///< of the area that masks or fit took for sky: facets used
  double seen_share = 0;     ///< of the upper hemisphere: facets in view
  double mean_disagreement = 0;  ///< between pictures, of the luminance of facets used that several see

  bool has_light() const { return model != SkyModel::kNone; }
  /// Unit, world.
  Eigen::Vector3d sun_in_world() const { return sky_from_world.transpose() * sun; }

  /// Of the sky in a direction (unit) without the sun's disc; 0 below the horizon and without a model.
  Eigen::Vector3d radiance(const Eigen::Vector3d& direction) const;
  /// Radiance in the sky's own frame, also below the horizon as if at it.
  Eigen::Vector3d radiance_in_sky(const Eigen::Vector3d& direction) const;
};

/// Answers many questions on one sky: radiances are tabulated once.
class SkyLight {
 public:
  explicit SkyLight(const NodeSky& sky);

  /// Of the dome on a surface with this normal (unit, world), nothing in the way: the cosine-weighted
  /// integral of radiance above the horizon, and the sun's light where it faces the sun.
  Eigen::Vector3d irradiance(const Eigen::Vector3d& normal, Disc disc) const;
  /// On a surface that looks up.
  Eigen::Vector3d horizontal_irradiance(Disc disc) const;
  /// What a white surface that looks up would look like: horizontal irradiance / pi. Samples divided by it
  /// are under canonical light (equations.md §7).
  Eigen::Vector3d canonical_light(Disc disc = Disc::kWith) const;
  /// Plain mean of radiance over the dome; the disc counts by its solid angle [Jethwa04] §7.2.3.
  Eigen::Vector3d mean_radiance(Disc disc = Disc::kWith) const;

 private:
  std::vector<Eigen::Vector3d> directions_;  ///< of facets of the dome, world
  std::vector<Eigen::Vector3d> light_;       ///< their radiance x solid angle
  Eigen::Vector3d up_, sun_, sun_irradiance_;
};

/// Radiance in all directions of the sky's frame as an equirectangular map (sky_picture.h); 0 below the
/// horizon. The disc's light is spread over the pixels that it covers, half a degree at least.
Image sky_map(const NodeSky& sky, Disc disc, int width = 512, int height = 256);

/// Real spherical functions up to an order, (order + 1)^2 values, orthonormal on the sphere; order 0 to 4.
std::vector<double> spherical_functions(int order, const Eigen::Vector3d& direction);

}  // namespace roxel

#include "roxel/sky/sky_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "roxel/base/angles.h"
#include "roxel/base/formatted.h"
#include "roxel/sky/perez_fit.h"
#include "roxel/sky/sun_search.h"

namespace roxel {
namespace {

constexpr double kHemisphere = 2 * kPi;
constexpr double kNightDeg = -6;         ///< civil twilight ends
constexpr double kLeastShare = 0.0005;   ///< of the hemisphere, for any model
constexpr double kShareForShape = 0.03;  ///< of the hemisphere, for free parameters
/// Of log radiance: no model fits better everywhere, and none is good near the horizon and the sun.
constexpr double kAgreeSigmas = 3, kAlwaysAgrees = 0.12, kAtHorizon = 0.5, kHorizonDeg = 6;
constexpr double kAgreesWithOneColor = 0.35;  ///< real skies have a gradient
constexpr double kAtSun = 0.5, kSunDeg = 10;
constexpr double kPriorStrength = 2e-5;  ///< as much as a relative error of 0.7 % at one prior deviation
/// Regions apart from the sky's (gaps, arches) must be about as bright and of that colour: windows are
/// darker.
constexpr double kApartBrightness = 0.5, kApartColor = 0.25;
/// Clouds against walls, where a volume knows of neither: smooth, grey or blue, not much darker than the
/// model.
constexpr double kCloudContrast = 0.5, kCloudRedBlue = 1.15, kCloudDarkest = 0.5;
constexpr double kLeastSigma = 0.01, kMostSigma = 0.15;
constexpr double kSunsDifferDeg = 2;
constexpr double kSurelySun = 30;  ///< contrast of a spot worth a warning: lamps and white walls have less

double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(a.dot(b), -1.0, 1.0)) / kDegree;
}

/// Direct over diffuse light by the middle of each bin of clearness [Perez93] eq. (1).
double direct_over_diffuse(int bin, double sun_zenith) {
  constexpr double kMiddle[kClearnessBins] = {1.02, 1.14, 1.36, 1.7, 2.3, 3.5, 5.3, 9};
  return (kMiddle[bin] - 1) * (1 + 1.041 * std::pow(sun_zenith, 3));
}

/// Colour of sunlight through clean air with some haze, luminance 1.
Eigen::Vector3d sunlight_color(double sine_elevation) {
  const Eigen::Array3d depth(0.118, 0.197, 0.375);  // at 680, 550, 440 nm
  const double air_mass =
      1 / (std::max(0.0, sine_elevation) + 0.025 * std::exp(-11 * std::max(0.0, sine_elevation)));
  const Eigen::Vector3d color = (-depth * air_mass).exp().matrix();
  return color / luminance(color);
}

class Fitting {
 public:
  Fitting(const SkyTask& task, const SkyPictureSource& pictures, const SkyFitOptions& options)
      : task_(task),
        pictures_(pictures),
        options_(options),
        sphere_(FacetSphere::of_level(options.facet_level)) {}

  SkyFit take() {
    describe();
    gather();
    find_suns();
    out_.masks = sky_masks(out_.light, known_sun(), options_.masks);
    out_.used = out_.masks.sky;
    fit();
    find_beyond_model();
    measure_fit();
    weigh_sun();
    return std::move(out_);
  }

 private:
  NodeSky& sky() { return out_.sky; }
  std::optional<Eigen::Vector3d> known_sun() const {
    return out_.sky.sun_source == SunSource::kNone ? std::nullopt : std::optional(out_.sky.sun);
  }

  void describe() {
    sky().name = task_.name;
    sky().views = task_.views;
    sky().time_utc_s = task_.time_utc_s;
    sky().latitude_deg = task_.latitude_deg;
    sky().longitude_deg = task_.longitude_deg;
    sky().sky_from_world = task_.sky_from_world;
    if (task_.time_utc_s && task_.latitude_deg && task_.longitude_deg)
      sky().sun_by_time =
          sun_direction(sun_position(*task_.time_utc_s, *task_.latitude_deg, *task_.longitude_deg));
    if (options_.sun)
      use_sun(SunSource::kGiven, sun_direction(*options_.sun));
    else if (sky().sun_by_time)
      use_sun(SunSource::kTime, *sky().sun_by_time);
  }

  void use_sun(SunSource source, const Eigen::Vector3d& direction) {
    sky().sun_source = source;
    sky().sun = direction;
  }

  /// One look at each picture.
  void gather() {
    SphereLightSum sum(sphere_);
    for (std::size_t i = 0; i < task_.views.size(); ++i) {
      const SkyPicture picture = pictures_(static_cast<int>(i));
      sum.add(picture);
      if (known_sun()) measure(picture);
    }
    out_.light = sum.result();
  }

  void measure(const SkyPicture& picture) {
    const SunMeasure measured = measure_sun(picture, sky().sun);
    if (measured.in_view) measures_.push_back(measured);
  }

  void find_suns() {
    const auto found = find_sun(out_.light);
    if (found) sky().sun_by_images = found->direction;
    if (!sky().sun_by_images) return;
    if (!known_sun()) {
      use_sun(SunSource::kImages, *sky().sun_by_images);
      for (std::size_t i = 0; i < task_.views.size(); ++i) measure(pictures_(static_cast<int>(i)));
      return;
    }
    const double apart = angle_deg(sky().sun, *sky().sun_by_images);
    if (apart > kSunsDifferDeg && found->contrast > kSurelySun)
      out_.warnings.push_back(
          formatted("sun %s and the brightest spot of the images are %.1f degrees apart: a "
                    "reflection, or a wrong time, place or north",
                    sky().sun_source == SunSource::kGiven ? "by hand" : "by time", apart));
  }

  double share_used() const {
    double area = 0;
    for (int f = 0; f < sphere_->count(); ++f)
      if (out_.used[f]) area += sphere_->solid_angle(f);
    return area / kHemisphere;
  }

  double share_clipped() const {
    double area = 0;
    for (int f = 0; f < sphere_->count(); ++f)
      if (sphere_->centre(f).z() > 0 && out_.light.facets[f].clipped > out_.light.facets[f].weight)
        area += sphere_->solid_angle(f);
    return area / kHemisphere;
  }

  /// What the pictures can decide, and why not more.
  SkyModel decidable() {
    if (sky().sun_by_time && sky().sun_by_time->z() < std::sin(kNightDeg * kDegree)) {
      sky().fallback = "night";
      return SkyModel::kNone;
    }
    const double share = share_used();
    if (share < kLeastShare) {
      sky().fallback = share_clipped() > kLeastShare ? kClippedSky : "no sky in view";
      return SkyModel::kNone;
    }
    if (share < kShareForShape) {
      sky().fallback = "little sky in view";
      return known_sun() ? SkyModel::kPublished : SkyModel::kUniform;
    }
    if (known_sun()) return SkyModel::kPerez;
    sky().fallback = "sun not known";
    return SkyModel::kGradation;
  }

  std::vector<SkySample> samples() const {
    std::vector<SkySample> samples;
    for (int f = 0; f < sphere_->count(); ++f)
      if (out_.used[f])
        samples.push_back({sphere_->centre(f), out_.light.facets[f].mean, sphere_->solid_angle(f)});
    return samples;
  }

  void fit() {
    sky().model = decidable();
    for (out_.rounds = 0; sky().has_light() && out_.rounds < options_.most_rounds && !out_.settled;
         ++out_.rounds) {
      fit_channels();
      const std::vector<std::uint8_t> agreeing = agreeing_facets();
      out_.settled = agreeing == out_.used;
      out_.used = agreeing;
      if (share_used() < kLeastShare) {
        sky().model = SkyModel::kNone;
        sky().fallback = "no sky in view";
      }
    }
    if (!sky().has_light()) std::fill(out_.used.begin(), out_.used.end(), std::uint8_t{0});
  }

  void fit_channels() {
    const std::vector<SkySample> seen = samples();
    PerezFitOptions fit;
    fit.prior_strength = kPriorStrength;
    fit.freedom = options_.free_exponent ? PerezFreedom::kExponent : PerezFreedom::kFull;
    if (sky().model == SkyModel::kPublished || sky().model == SkyModel::kUniform)
      fit.freedom = PerezFreedom::kScaleOnly;
    if (sky().model == SkyModel::kGradation) fit.freedom = PerezFreedom::kGradation;
    for (int c = 0; c < 3; ++c) {
      fit.starts = sky().model == SkyModel::kUniform ? std::vector<PerezShape>{PerezShape{}}
                                                     : published_starts(sky().sun);
      if (out_.rounds > 0) fit.starts = {sky().channels[c].shape};
      sky().channels[c] = fit_perez(seen, c, sky().sun, fit).channel;
    }
    fit_residual(seen);
    find_sigma(seen);
  }

  /// Spherical functions of log(seen / model), held back towards 0, more so the finer they are.
  void fit_residual(const std::vector<SkySample>& seen) {
    sky().residual_order = 0;
    if (options_.residual_order == 0 || sky().model != SkyModel::kPerez) return;
    const int order = options_.residual_order, size = (order + 1) * (order + 1);
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(size, 3);
    double total = 0;
    for (const SkySample& s : seen) total += s.weight;
    for (const SkySample& s : seen) {
      const std::vector<double> values = spherical_functions(order, s.direction);
      const Eigen::Map<const Eigen::VectorXd> y(values.data(), size);
      const Eigen::Vector3d ratio = (s.radiance.array() / sky().radiance_in_sky(s.direction).array()).log();
      const Eigen::Vector3d bounded = ratio.cwiseMax(-kMostSigma).cwiseMin(kMostSigma);
      normal += s.weight / total * y * y.transpose();
      right += s.weight / total * y * bounded.transpose();
    }
    for (int l = 0, i = 0; l <= order; ++l)
      for (int m = -l; m <= l; ++m, ++i) normal(i, i) += 1e-4 * (1 + l * l * l * l);
    const Eigen::MatrixXd solved = normal.ldlt().solve(right);
    for (int c = 0; c < 3; ++c) sky().residual[c].assign(solved.col(c).data(), solved.col(c).data() + size);
    sky().residual_order = order;
  }

  Eigen::Vector3d log_ratio(const Eigen::Vector3d& direction, const Eigen::Vector3d& seen) const {
    return (seen.array() / out_.sky.radiance_in_sky(direction).array().max(1e-30)).log().matrix();
  }

  /// From the median, so that walls among the facets do not widen it.
  void find_sigma(const std::vector<SkySample>& seen) {
    for (int c = 0; c < 3; ++c) {
      std::vector<double> errors;
      for (const SkySample& s : seen) errors.push_back(std::abs(log_ratio(s.direction, s.radiance)[c]));
      const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
      std::nth_element(errors.begin(), middle, errors.end());
      sky().relative_sigma[c] = std::clamp(1.4826 * *middle, kLeastSigma, kMostSigma);
    }
  }

  bool agrees(int f) const {
    const Eigen::Array3d error = log_ratio(sphere_->centre(f), out_.light.facets[f].mean).array().abs();
    const double elevation = std::asin(sphere_->centre(f).z()) / kDegree;
    const double anywhere = out_.sky.model == SkyModel::kUniform ? kAgreesWithOneColor : kAlwaysAgrees;
    const double always = anywhere + kAtHorizon * std::exp(-elevation / kHorizonDeg) +
                          kAtSun * std::exp(-angle_deg(sphere_->centre(f), out_.sky.sun) / kSunDeg);
    return (error < (kAgreeSigmas * out_.sky.relative_sigma.array()).max(always)).all();
  }

  bool may_be_sky(const std::vector<int>& region) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int f : region) sum += log_ratio(sphere_->centre(f), out_.light.facets[f].mean);
    const Eigen::Vector3d mean = sum / static_cast<double>(region.size());
    const double brightness = mean.mean();
    return std::abs(brightness) < kApartBrightness &&
           (mean.array() - brightness).abs().maxCoeff() < kApartColor;
  }

  /// Facets that agree with the model and hang together with those that were used.
  std::vector<std::uint8_t> agreeing_facets() const {
    std::vector<std::uint8_t> agreeing(out_.used.size());
    std::vector<int> queue;
    const auto take = [&](int f) {
      const SkyMasks& m = out_.masks;
      if (agreeing[f] || m.unusable[f] || m.near_sun[f] || m.variance[f] || !agrees(f)) return;
      agreeing[f] = 1;
      queue.push_back(f);
    };
    for (int f = 0; f < sphere_->count(); ++f)
      if (out_.used[f] && out_.masks.sky[f]) take(f);
    for (const std::vector<int>& region : out_.masks.apart)
      if (may_be_sky(region))
        for (const int f : region) take(f);
    for (std::size_t i = 0; i < queue.size(); ++i)
      for (const int next : sphere_->neighbours(queue[i])) take(next);
    return agreeing;
  }

  /// Clouds over a clear sky, and the blue between clouds.
  bool may_be_cloud(int f) const {
    const FacetLight& facet = out_.light.facets[f];
    const SkyMasks& m = out_.masks;
    if (m.unusable[f] || m.near_sun[f] || out_.used[f] || !is_open(facet)) return false;
    const double bright = luminance(facet.mean) / luminance(out_.sky.radiance_in_sky(sphere_->centre(f)));
    return facet.contrast < kCloudContrast && facet.mean[0] < kCloudRedBlue * facet.mean[2] &&
           bright > kCloudDarkest;
  }

  void find_beyond_model() {
    out_.beyond_model.assign(out_.used.size(), 0);
    if (!sky().has_light()) return;
    std::vector<int> queue;
    const auto spread = [&](int from) {
      for (const int next : sphere_->neighbours(from))
        if (!out_.beyond_model[next] && may_be_cloud(next))
          out_.beyond_model[next] = 1, queue.push_back(next);
    };
    for (int f = 0; f < sphere_->count(); ++f)
      if (out_.used[f]) spread(f);
    for (std::size_t i = 0; i < queue.size(); ++i) spread(queue[i]);
  }

  void measure_fit() {
    NodeSky& s = sky();
    double error = 0, weight = 0, disagreement = 0, seen_twice = 0, in_view = 0;
    for (int f = 0; f < sphere_->count(); ++f) {
      const FacetLight& facet = out_.light.facets[f];
      const double area = sphere_->solid_angle(f);
      if (sphere_->centre(f).z() > 0) in_view += area * facet.coverage;
      if (!out_.used[f]) continue;
      const Eigen::Array3d ratio = s.radiance_in_sky(sphere_->centre(f)).array() / facet.mean.array();
      error += area * (ratio - 1).abs().mean();
      weight += area;
      if (facet.pictures > 1) disagreement += area * facet.disagreement, seen_twice += area;
    }
    s.seen_share = in_view / kHemisphere;
    s.sky_share = weight / kHemisphere;
    s.mean_error = weight > 0 ? error / weight : 0;
    s.mean_disagreement = seen_twice > 0 ? disagreement / seen_twice : 0;
    if (s.has_light()) find_clearness();
  }

  void find_clearness() {
    PerezFitOptions fit;
    fit.freedom = PerezFreedom::kScaleOnly;
    fit.starts = published_starts(sky().sun);
    fit.starts.resize(kClearnessBins);
    sky().clearness_bin = known_sun() ? fit_perez(samples(), 1, sky().sun, fit).start : 0;
  }

  /// Whether facets around the sun were taken for sky: then nothing hides it.
  bool sky_around_sun() const {
    double around = 0, used = 0;
    for (int f = 0; f < sphere_->count(); ++f) {
      const double apart = angle_deg(sphere_->centre(f), out_.sky.sun);
      if (apart < 3.5 || apart > 8) continue;
      around += sphere_->solid_angle(f);
      if (out_.used[f]) used += sphere_->solid_angle(f);
    }
    return used > 0.5 * around;
  }

  void weigh_sun() {
    NodeSky& s = sky();
    if (!s.has_light() || !known_sun() || s.sun.z() <= 0) return;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int measured = 0;
    bool dark = false, clipped = false;
    for (const SunMeasure& m : measures_) {
      clipped |= m.clipped;
      dark |= !m.shines;
      if (m.shines && !m.clipped) sum += m.irradiance, ++measured;
    }
    if (measured > 0) {
      s.sun_light = SunLight::kMeasured;
      s.sun_irradiance = sum / measured;
      return;
    }
    if (!clipped && ((dark && sky_around_sun()) || s.clearness_bin <= 1)) return;  // overcast
    const double diffuse = luminance(SkyLight(s).horizontal_irradiance(Disc::kWithout));
    s.sun_light = SunLight::kEstimated;
    s.sun_irradiance = diffuse * direct_over_diffuse(std::max(2, s.clearness_bin), std::acos(s.sun.z())) *
                       sunlight_color(s.sun.z());
  }

  const SkyTask& task_;
  const SkyPictureSource& pictures_;
  const SkyFitOptions& options_;
  std::shared_ptr<const FacetSphere> sphere_;
  std::vector<SunMeasure> measures_;
  SkyFit out_;
};

}  // namespace

SkyFit fit_sky(const SkyTask& task, const SkyPictureSource& pictures, const SkyFitOptions& options) {
  return Fitting(task, pictures, options).take();
}

}  // namespace roxel

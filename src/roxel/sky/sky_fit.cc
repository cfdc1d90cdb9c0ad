#include "roxel/sky/sky_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "roxel/base/angles.h"
#include "roxel/base/formatted.h"
#include "roxel/base/median.h"
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
/// Regions apart from the sky's (gaps, arches) must be about as bright and of that colour: windows are
/// darker.
constexpr double kApartBrightness = 0.5, kApartColor = 0.25;
/// Clouds against walls, where a volume knows of neither: smooth, grey or blue, not much darker than the
/// model.
constexpr double kCloudContrast = 0.5, kCloudRedBlue = 1.15, kCloudDarkest = 0.5;
constexpr double kIslandInSky = 0.3;  ///< of the edge of a cloud that does not touch the sky of the fit
constexpr std::size_t kLeastIsland = 4;
constexpr int kMostMixed = 4;  ///< facets beyond such an edge
constexpr double kLeastSigma = 0.01, kMostSigma = 0.15;
constexpr double kSunsDifferDeg = 2;
/// Contrast of a spot that is a sun without glare: lamps and white walls have less. Not where white is 1,
/// which dark photographs show of walls.
constexpr double kSurelySun = 30, kDisplayWhite = 1.0001;
/// Of log sunlight, over nine skies (docs/results/sky.md); of a measurement, at least.
constexpr double kEstimatedSunSigma = 0.47, kMeasuredSunSigma = 0.02;
/// Facets that clip: share of the clip level that a model must come to, and how far other channels may be
/// off.
constexpr double kAboutClips = 0.75, kClippedColor = 0.3;
constexpr double kBorneOutByFit = 0.5;  ///< of clipped sky high up, by a fit to what does not clip
constexpr double kMuchClipped = 0.1;    ///< of what is fitted, worth a warning
constexpr double kFewPixels = 2;
constexpr const char* kNight = "night";

double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(a.dot(b), -1.0, 1.0)) / kDegree;
}

/// Light of a clear sky's sun on a surface that faces it, over that of its dome on the horizontal: mean
/// values in lux [IES84], for clean or hazy air by -b of the fit, which is 0.31 in theirs. The power is read
/// off 24 computed skies whose light is scattered more than once: within 4 % there (docs/sky.md).
double direct_over_diffuse(double sine_elevation, double haze) {
  const double sine = std::max(0.02, sine_elevation);
  const double sun = 127500 * std::exp(-0.21 / sine), dome = 800 + 15500 * std::sqrt(sine);
  return sun / dome * std::pow(0.31 / std::clamp(haze, 0.15, 0.8), 1.3);
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
    out_.masks = sky_masks(out_.light, known_sun(), options_.masks);
    look_for_sun();
    out_.used = out_.masks.sky;
    fit();
    find_clipped_sky();
    find_beyond_model();
    measure_fit();
    look_for_another_sun();
    weigh_sun();
    out_.fitted = sky();
    give_up_clipped_light();
    warn();
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
    sky().centres = task_.centres;
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

  /// Where nothing else says where the sun is; with it the masks are others.
  void look_for_sun() {
    spots_ = bright_spots(out_.light);
    if (known_sun()) return;
    find_sure_sun(out_.masks.sky);
    if (!found_) return;
    use_sun(SunSource::kImages, found_->direction);
    for (std::size_t i = 0; i < task_.views.size(); ++i) measure(pictures_(static_cast<int>(i)));
    out_.masks = sky_masks(out_.light, known_sun(), options_.masks);
  }

  /// Where time or hand say where the sun is, and the fit what is sky: is there one elsewhere?
  void look_for_another_sun() {
    if (!known_sun() || sky().sun_source == SunSource::kImages) return;
    std::vector<std::uint8_t> taken = out_.masks.sky;
    for (std::size_t f = 0; f < taken.size(); ++f) taken[f] |= out_.used[f];
    find_sure_sun(taken);
  }

  /// The first of the bright spots that is surely a sun; at night lamps stand out as much.
  void find_sure_sun(const std::vector<std::uint8_t>& taken_for_sky) {
    const bool night = sky().fallback == kNight;
    for (const FoundSun& spot : spots_) {
      const bool stands_out = spot.contrast > kSurelySun && spot.peak > kDisplayWhite;
      if (!(stands_out && !night) && !glares(out_.light, taken_for_sky, spot)) continue;
      found_ = spot;
      sky().sun_by_images = spot.direction;
      return;
    }
  }

  double share_used() const {
    double area = 0;
    for (int f = 0; f < sphere_->count(); ++f)
      if (out_.used[f]) area += sphere_->solid_angle(f);
    return area / kHemisphere;
  }

  /// What the pictures can decide, and why not more.
  SkyModel decidable() {
    sky().fallback.clear();
    const bool computed = sky().sun_source == SunSource::kGiven || sky().sun_source == SunSource::kTime;
    if (computed && sky().sun.z() < std::sin(kNightDeg * kDegree)) {
      sky().fallback = kNight;
      return SkyModel::kNone;
    }
    const double share = share_used();
    if (share < kLeastShare) {
      sky().fallback = "no sky in view";
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

  /// Facets change from round to round, and with them what can be decided.
  void fit() {
    sky().model = decidable();
    for (out_.rounds = 0; sky().has_light() && out_.rounds < options_.most_rounds && !out_.settled;
         ++out_.rounds) {
      fit_channels();
      std::vector<std::uint8_t> agreeing = agreeing_facets();
      out_.settled = agreeing == out_.used;
      out_.used = std::move(agreeing);
      const SkyModel before = sky().model;
      sky().model = decidable();
      if (sky().model == before) continue;
      out_.settled = false, fitted_before_ = false;
      if (out_.rounds + 1 == options_.most_rounds && sky().has_light()) fit_channels();
    }
    if (!sky().has_light()) std::fill(out_.used.begin(), out_.used.end(), std::uint8_t{0});
  }

  void fit_channels() {
    const std::vector<SkySample> seen = samples();
    PerezFitOptions fit;
    fit.prior_strength = kSkyPrior;
    fit.freedom = options_.free_exponent ? PerezFreedom::kExponent : PerezFreedom::kFull;
    if (sky().model == SkyModel::kPublished || sky().model == SkyModel::kUniform)
      fit.freedom = PerezFreedom::kScaleOnly;
    if (sky().model == SkyModel::kGradation) fit.freedom = PerezFreedom::kGradation;
    for (int c = 0; c < 3; ++c) {
      fit.starts = sky().model == SkyModel::kUniform ? std::vector<PerezShape>{PerezShape{}}
                                                     : published_starts(sky().sun);
      if (fitted_before_) fit.starts = {sky().channels[c].shape};
      sky().channels[c] = fit_perez(seen, c, sky().sun, fit).channel;
    }
    fitted_before_ = true;
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
      sky().relative_sigma[c] = std::clamp(1.4826 * median(errors), kLeastSigma, kMostSigma);
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
    if (out_.masks.by_hand) return out_.masks.sky;  // a person said which, and which alone
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
    for (const auto* regions : {&out_.masks.apart, &out_.masks.unexplained})
      for (const std::vector<int>& region : *regions)
        if (may_be_sky(region))
          for (const int f : region) take(f);
    for (std::size_t i = 0; i < queue.size(); ++i)
      for (const int next : sphere_->neighbours(queue[i])) take(next);
    return agreeing;
  }

  /// Whether a facet that clips is what the model says of it: it would clip, too, and what does not clip has
  /// that colour.
  bool clips_as_fitted(int f) const {
    const FacetLight& facet = out_.light.facets[f];
    const Eigen::Vector3d model = out_.sky.radiance_in_sky(sphere_->centre(f));
    if (model.maxCoeff() < kAboutClips * facet.clip) return false;
    for (int c = 0; c < 3; ++c) {
      const double seen = facet.clipped_mean[c];
      if (model[c] < (seen < facet.clip ? 1 - kClippedColor : kAboutClips) * std::min(seen, facet.clip))
        return false;
      if (seen < kAboutClips * facet.clip && model[c] > (1 + kClippedColor) * seen) return false;
    }
    return true;
  }

  /// Facets that clip: those that go on where the fit ends, as it says; and where the highest of all that is
  /// seen clips and the fit does not bear that out, all that hang together there.
  void find_clipped_sky() {
    out_.clipped_sky.assign(out_.used.size(), 0);
    if (sky().fallback == kNight) return;
    std::vector<int> queue;
    const auto take = [&](int f) { out_.clipped_sky[f] = 1, queue.push_back(f); };
    const auto spread = [&](int from, const auto& belongs) {
      for (const int next : sphere_->neighbours(from)) {
        const bool above =
            sphere_->centre(next).z() > std::sin(options_.masks.lowest_elevation_deg * kDegree);
        if (above && !out_.clipped_sky[next] && clipped_share(out_.light.facets[next]) > kClippedShare &&
            belongs(next))
          take(next);
      }
    };
    const auto as_fitted = [&](int f) { return out_.masks.near_sun[f] || clips_as_fitted(f); };
    if (sky().has_light() && !out_.masks.by_hand)
      for (int f = 0; f < sphere_->count(); ++f)
        if (out_.used[f]) spread(f, as_fitted);
    for (std::size_t i = 0; i < queue.size(); ++i) spread(queue[i], as_fitted);
    double white = 0, borne_out = 0;
    for (const int f : out_.masks.white) {
      const double height = sphere_->solid_angle(f) * sphere_->centre(f).z();
      white += height;
      if (out_.clipped_sky[f]) borne_out += height;
    }
    if (borne_out >= kBorneOutByFit * white) return;
    queue.clear();
    for (const int f : out_.masks.white) take(f);
    const auto at_border = [&](int f) {
      return !out_.masks.by_hand && out_.light.facets[f].coverage < options_.masks.least_coverage;
    };
    for (std::size_t i = 0; i < queue.size(); ++i) spread(queue[i], at_border);
  }

  /// Where more of the sky clips than was fitted, the rest says little of its light.
  void give_up_clipped_light() {
    double clipped = 0;
    for (int f = 0; f < sphere_->count(); ++f)
      if (out_.clipped_sky[f] && !out_.masks.near_sun[f]) clipped += sphere_->solid_angle(f) / kHemisphere;
    sky().clipped_share = out_.fitted.clipped_share = clipped;
    if (clipped < kLeastShare || clipped <= share_used()) return;
    sky().model = SkyModel::kNone;
    sky().fallback = kClippedSky;
    sky().sun_light = SunLight::kNone;
    sky().sun_irradiance.setZero();
    sky().sun_relative_sigma = 0;
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

  /// Whether there is sky at most so many facets away.
  bool near_sky(int f, int steps) const {
    if (out_.used[f] || out_.beyond_model[f]) return true;
    return steps > 0 &&
           std::ranges::any_of(sphere_->neighbours(f), [&](int n) { return near_sky(n, steps - 1); });
  }

  /// Facets that a pixel at an edge reaches into, and the one that it is in.
  int mixed_facets(int f) const {
    const FacetLight& facet = out_.light.facets[f];
    const double pixels = facet.pixels / facet.pictures;
    return 1 + std::min(kMostMixed, static_cast<int>(std::ceil(1 / std::sqrt(std::max(pixels, 1e-3)))));
  }

  /// What of the smooth regions that a volume does not explain may be cloud.
  std::vector<std::vector<int>> islands() const {
    std::vector<std::vector<int>> found;
    std::vector<std::uint8_t> may_be(out_.used.size()), taken(out_.used.size());
    for (const std::vector<int>& region : out_.masks.unexplained)
      for (const int f : region) may_be[f] = may_be_cloud(f);
    const auto belongs = [&](int f) { return may_be[f] != 0; };
    for (int seed = 0; seed < sphere_->count(); ++seed) {
      if (taken[seed] || !belongs(seed)) continue;
      taken[seed] = 1;
      std::vector<int>& island = found.emplace_back(1, seed);
      for (std::size_t i = 0; i < island.size(); ++i)
        for (const int next : sphere_->neighbours(island[i]))
          if (!taken[next] && belongs(next)) taken[next] = 1, island.push_back(next);
      if (island.size() < kLeastIsland) found.pop_back();
    }
    return found;
  }

  /// Whether sky goes on beyond three tenths of an island's edge, as far as pictures show it. Walls that a
  /// volume lacks may have sky above them, but walls to the sides and below; clouds may be cut off by roofs.
  bool is_in_sky(const std::vector<int>& island) const {
    double edge = 0, in_sky = 0;
    for (const int f : island)
      for (const int next : sphere_->neighbours(f)) {
        if (std::ranges::binary_search(island, next) || !(out_.light.facets[next].coverage > 0)) continue;
        ++edge, in_sky += near_sky(next, mixed_facets(f));
      }
    return in_sky > kIslandInSky * edge;
  }

  /// Clouds with sharp edges, one after another, as they may hide what is between.
  void take_islands() {
    std::vector<std::vector<int>> left = islands();
    for (std::vector<int>& island : left) std::ranges::sort(island);
    for (std::size_t before = left.size() + 1; left.size() < before;) {
      before = left.size();
      std::erase_if(left, [&](const std::vector<int>& island) {
        if (!is_in_sky(island)) return false;
        for (const int f : island) out_.beyond_model[f] = 1;
        return true;
      });
    }
  }

  void find_beyond_model() {
    out_.beyond_model.assign(out_.used.size(), 0);
    if (!sky().has_light() || out_.masks.by_hand) return;
    take_islands();
    std::vector<int> queue;
    const auto spread = [&](int from) {
      for (const int next : sphere_->neighbours(from))
        if (!out_.beyond_model[next] && may_be_cloud(next))
          out_.beyond_model[next] = 1, queue.push_back(next);
    };
    for (int f = 0; f < sphere_->count(); ++f)
      if (out_.used[f] || out_.beyond_model[f]) spread(f);
    for (std::size_t i = 0; i < queue.size(); ++i) spread(queue[i]);
  }

  void measure_fit() {
    NodeSky& s = sky();
    double error = 0, weight = 0, disagreement = 0, seen_twice = 0, in_view = 0, taken_for_sky = 0,
           pixels = 0;
    for (int f = 0; f < sphere_->count(); ++f) {
      const FacetLight& facet = out_.light.facets[f];
      const double area = sphere_->solid_angle(f);
      if (sphere_->centre(f).z() > 0) in_view += area * facet.coverage;
      if (out_.masks.sky[f] && !out_.used[f]) taken_for_sky += area;
      if (!out_.used[f]) continue;
      const Eigen::Array3d ratio = s.radiance_in_sky(sphere_->centre(f)).array() / facet.mean.array();
      error += area * (ratio - 1).abs().mean();
      weight += area;
      pixels += area * facet.pixels;
      if (facet.pictures > 1) disagreement += area * facet.disagreement, seen_twice += area;
    }
    s.seen_share = in_view / kHemisphere;
    s.sky_share = weight / kHemisphere;
    out_.pixels_per_facet = weight > 0 ? pixels / weight : 0;
    s.inlier_share = weight > 0 ? weight / (weight + taken_for_sky) : 0;
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
    std::vector<std::uint8_t> taken = out_.used;
    for (std::size_t f = 0; f < taken.size(); ++f) taken[f] |= out_.clipped_sky[f];
    return sky_ring(out_.light, taken, out_.sky.sun, 3.5, 8).sky_share > 0.5;
  }

  /// The sun where none is seen though the sky there is clear, brighter towards the horizon: it stands
  /// elsewhere.
  bool clear_without_sun() const {
    return dark_ && !clipped_ && sky_around_sun() && out_.sky.model == SkyModel::kPerez && !overcast();
  }

  /// Brighter at the zenith than at the horizon.
  bool overcast() const { return out_.sky.channels[1].shape.a > 0; }

  void weigh_sun() {
    NodeSky& s = sky();
    if (!s.has_light() || !known_sun() || s.sun.z() <= 0) return;
    std::vector<Eigen::Vector3d> measured;
    for (const SunMeasure& m : measures_) {
      clipped_ |= m.clipped;
      dark_ |= !m.shines;
      shines_ |= m.shines;
      if (m.shines && !m.clipped) measured.push_back(m.irradiance);
    }
    if (!measured.empty()) return use_measured(measured);
    if (overcast() || (!clipped_ && dark_ && sky_around_sun() && !clear_without_sun())) return;
    const double diffuse = luminance(SkyLight(s).horizontal_irradiance(Disc::kWithout));
    s.sun_light = SunLight::kEstimated;
    s.sun_irradiance =
        diffuse * direct_over_diffuse(s.sun.z(), -s.channels[1].shape.b) * sunlight_color(s.sun.z());
    s.sun_relative_sigma = kEstimatedSunSigma;
  }

  void use_measured(const std::vector<Eigen::Vector3d>& measured) {
    const auto count = static_cast<double>(measured.size());
    NodeSky& s = sky();
    s.sun_light = SunLight::kMeasured;
    s.sun_irradiance.setZero();
    for (const Eigen::Vector3d& m : measured) s.sun_irradiance += m / count;
    double squares = 0;
    for (const Eigen::Vector3d& m : measured) {
      const double off = luminance(m) / luminance(s.sun_irradiance) - 1;
      squares += off * off;
    }
    s.sun_relative_sigma = std::max(kMeasuredSunSigma, std::sqrt(squares / std::max(1.0, count - 1)));
  }

  void warn() {
    const auto say = [&](std::string text) { out_.warnings.push_back(std::move(text)); };
    if (const int by_hand = out_.light.masked_by_hand; by_hand > 0 && by_hand < out_.light.pictures)
      say(formatted("masks by hand for %d of %d images: sky is fitted only where those show it", by_hand,
                    out_.light.pictures));
    warn_of_clipping();
    if (out_.pixels_per_facet > 0 && out_.pixels_per_facet < kFewPixels && sphere_->level() > 4)
      say(formatted("%.1f pixels a facet: too few to tell texture, take fewer facets (--facets %d)",
                    out_.pixels_per_facet, sphere_->level() - 1));
    const bool apart = warn_of_suns();
    if (!out_.fitted.has_light()) return;
    warn_of_found_sun();
    if (options_.residual_order > 0 && sky().has_light() && sky().model != SkyModel::kPerez)
      say(formatted("--residual has no effect where the model is %s", to_string(sky().model)));
    if (!apart && clear_without_sun() && sky().sun_source != SunSource::kImages)
      say(formatted(
          "the sky is clear where the sun %s should be, and no sun is there: a wrong time, place or "
          "north",
          by_what()));
    if (sky().sun_light == SunLight::kEstimated)
      say(formatted("the sun's light is estimated, within a factor of %.1f: %s",
                    std::exp(sky().sun_relative_sigma),
                    clipped_ ? "its disc clips" : "no image shows its disc"));
  }

  const char* by_what() const { return out_.sky.sun_source == SunSource::kGiven ? "by hand" : "by time"; }

  void warn_of_clipping() {
    if (sky().fallback == kClippedSky)
      out_.warnings.push_back(
          formatted("%.0f %% of the dome is sky that clips, %.0f %% is not: no light is "
                    "known, take darker images",
                    100 * sky().clipped_share, 100 * share_used()));
    else if (sky().clipped_share > kMuchClipped * share_used())
      out_.warnings.push_back(
          formatted("%.0f %% of the dome is sky that clips: its light is that of a fit to "
                    "the other %.0f %%",
                    100 * sky().clipped_share, 100 * share_used()));
  }

  /// Two suns.
  bool warn_of_suns() {
    if (!found_ || sky().sun_source == SunSource::kImages) return false;
    const double apart = angle_deg(sky().sun, found_->direction);
    if (apart < kSunsDifferDeg + middle_within()) return false;
    if (shines_ && sky_around_sun()) return false;  // it is where it should be: the other is a reflection
    if (sky().fallback == kNight)
      out_.warnings.push_back(
          formatted("it is night %s, but the images show what glares amid sky as the sun does, %.1f degrees "
                    "apart from where it should be: a wrong time, zone, place or north",
                    by_what(), apart));
    else
      out_.warnings.push_back(
          formatted("sun %s and the brightest spot of the images are %.1f degrees apart: a "
                    "reflection, or a wrong time, place or north",
                    by_what(), apart));
    return true;
  }

  /// How far, in degrees, the middle of a glare that clips may be from the sun: roofs cut it, and towards the
  /// horizon it is wider (docs/sky.md).
  double middle_within() const { return found_->clipped ? found_->radius_deg / 2 : 0; }

  void warn_of_found_sun() {
    if (sky().sun_source == SunSource::kImages && middle_within() > kSunsDifferDeg)
      out_.warnings.push_back(formatted(
          "the sun is the middle of a glare that clips, within %.0f degrees: give time and place, or --sun",
          middle_within()));
    if (sky().model == SkyModel::kGradation && !spots_.empty())
      out_.warnings.push_back(
          "the sun is not known: what is brightest in the images need not be it; give time and place, or "
          "--sun");
  }

  const SkyTask& task_;
  const SkyPictureSource& pictures_;
  const SkyFitOptions& options_;
  std::shared_ptr<const FacetSphere> sphere_;
  std::vector<SunMeasure> measures_;
  std::vector<FoundSun> spots_;         ///< bright ones of the images
  std::optional<FoundSun> found_;       ///< the one of them that is surely a sun
  bool dark_ = false, shines_ = false;  ///< in an image, where the sun should be
  bool clipped_ = false;                ///< its disc, in an image
  bool fitted_before_ = false;          ///< channels hold a fit of this model
  SkyFit out_;
};

}  // namespace

SkyFit fit_sky(const SkyTask& task, const SkyPictureSource& pictures, const SkyFitOptions& options) {
  return Fitting(task, pictures, options).take();
}

}  // namespace roxel

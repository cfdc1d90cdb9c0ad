#include <algorithm>
#include <array>
#include <cmath>

#include "roxel/base/angles.h"
#include "roxel/base/median.h"
#include "roxel/sky/sky_fit.h"

namespace roxel {
namespace {

/// Density of log colour of what is not sky: alike over a factor of 50 in brightness and of 4 in hue.
constexpr double kElsewhere = 1 / (3.9 * 1.4 * 1.4);
/// A pixel is not a facet's mean: noise, thin cloud and blur are added to the model's deviation, at least
/// this.
constexpr double kLeastPixelSigma = 0.02, kMostPixelSigma = 0.1;
constexpr int kReach = 8;                  ///< facets that a correction is carried
constexpr double kDarkest = 1e-12;         ///< of light that others are compared with
constexpr double kAsGoodAsClipped = 0.75;  ///< of the clip level, for a model
constexpr double kFollowedStep =
    0.2 * kDegree;                  ///< between pixels that are compared where masks are followed
constexpr double kMostStep = 0.04;  ///< deviation of such pixels
constexpr double kDarkestSky = 1.0 / 3, kBrightestSky = 4;  ///< of the model: as far as masks are followed

/// Of sky, for errors of a logarithm of each channel and their deviations.
float posterior(const Eigen::Vector3d& error, const Eigen::Vector3d& sigma) {
  double exponent = 0, density = 1;
  for (int c = 0; c < 3; ++c) {
    exponent += 0.5 * (error[c] / sigma[c]) * (error[c] / sigma[c]);
    density /= std::sqrt(2 * M_PI) * sigma[c];
  }
  const double sky = density * std::exp(-exponent);
  return static_cast<float>(sky / (sky + kElsewhere));
}

class PixelMasking {
 public:
  PixelMasking(const SkyPicture& picture, const SkyFit& fit)
      : picture_(picture), fit_(fit), width_(picture.rays.width()), height_(picture.rays.height()) {}

  Mask take() {
    if (fit_.fitted.has_light()) find_corrections(), find_pixel_sigma();
    likeness_.assign(static_cast<std::size_t>(width_) * height_, 0.0f);
    facet_.assign(likeness_.size(), 0);
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) look(x, y);
    grow();
    follow();
    Mask mask(width_, height_, 0);
    for (std::size_t i = 0; i < likeness_.size(); ++i)
      if (reached_[i]) mask.data()[i] = static_cast<std::uint8_t>(std::lround(255 * likeness_[i]));
    return mask;
  }

 private:
  std::size_t at(int x, int y) const { return static_cast<std::size_t>(y) * width_ + x; }

  template <class Visit>
  void for_each_neighbour(std::size_t i, Visit&& visit) const {
    const int x = static_cast<int>(i % width_), y = static_cast<int>(i / width_);
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}})
      if (x + dx >= 0 && y + dy >= 0 && x + dx < width_ && y + dy < height_) visit(at(x + dx, y + dy));
  }

  /// No model fits everywhere: log(seen / model) of the facets of the fit, and beyond them as far as a few
  /// facets what their neighbours have.
  void find_corrections() {
    const FacetSphere& sphere = *fit_.light.sphere;
    correction_.assign(fit_.used.size(), Eigen::Vector3d::Zero());
    std::vector<int> ring;
    std::vector<std::uint8_t> known = fit_.used;
    for (int f = 0; f < sphere.count(); ++f) {
      known[f] |= fit_.beyond_model[f];
      if (!known[f]) continue;
      ring.push_back(f);
      const Eigen::Vector3d model = fit_.fitted.radiance_in_sky(sphere.centre(f));
      correction_[f] = (fit_.light.facets[f].mean.array() / model.array()).log().matrix();
    }
    for (int step = 0; step < kReach && !ring.empty(); ++step) {
      std::vector<int> next;
      for (const int f : ring)
        for (const int n : sphere.neighbours(f))
          if (!known[n]) known[n] = 2, next.push_back(n);
      for (const int f : next) {
        int count = 0;
        for (const int n : sphere.neighbours(f))
          if (known[n] == 1) correction_[f] += correction_[n], ++count;
        correction_[f] /= std::max(1, count);
      }
      for (const int f : next) known[f] = 1;
      ring = std::move(next);
    }
  }

  /// What pixels deviate by within the facets of the fit: the median.
  void find_pixel_sigma() {
    for (int c = 0; c < 3; ++c) {
      std::vector<double> deviations;
      for (std::size_t f = 0; f < fit_.used.size(); ++f)
        if (const FacetLight& facet = fit_.light.facets[f]; fit_.used[f] && facet.pixels > 1)
          deviations.push_back(std::sqrt(facet.variance[c]) / facet.mean[c]);
      pixel_sigma_[c] = std::clamp(median(deviations), kLeastPixelSigma, kMostPixelSigma);
    }
  }

  /// Whether the pixel is one at all, and not below the horizon.
  bool may_be_sky(int x, int y) const {
    if (!picture_.valid.empty() && picture_.valid.at(x, y) != 255) return false;
    return picture_.rays.direction(x + 0.5, y + 0.5).z() >= 0;
  }

  /// Posterior of sky by colour alone.
  void look(int x, int y) {
    if (!may_be_sky(x, y)) return;
    const Eigen::Vector3d direction = picture_.rays.direction(x + 0.5, y + 0.5);
    const FacetSphere& sphere = *fit_.light.sphere;
    if (!sphere.contains(last_facet_, direction)) last_facet_ = sphere.facet_at(direction);
    facet_[at(x, y)] = last_facet_;
    if (fit_.clipped_sky[last_facet_] && clips(x, y)) likeness_[at(x, y)] = 1;
    if (!fit_.fitted.has_light() || likeness_[at(x, y)] == 1) return;
    if (fit_.masks.near_sun[last_facet_] && shines(x, y)) {
      likeness_[at(x, y)] = 1;
      return;
    }
    const Eigen::Vector3d model =
        (fit_.fitted.radiance_in_sky(direction).array() * correction_[last_facet_].array().exp()).matrix();
    const double unrest = fit_.beyond_model[last_facet_] ? fit_.light.facets[last_facet_].contrast : 0;
    Eigen::Vector3d error, sigma;
    for (int c = 0; c < 3; ++c) {
      error[c] = log_error(picture_.rgb.pixel(x, y)[c], model[c]);
      sigma[c] = std::hypot(fit_.fitted.relative_sigma[c], pixel_sigma_[c], unrest);
    }
    likeness_[at(x, y)] = posterior(error, sigma);
  }

  /// A clipped pixel says "at least this".
  double log_error(double seen, double model) const {
    if (seen >= picture_.clip && model >= kAsGoodAsClipped * picture_.clip) return 0;
    return std::log(std::max(seen, 1e-6 * model) / std::max(model, 1e-30));
  }

  bool clips(int x, int y) const {
    const float* rgb = picture_.rgb.pixel(x, y);
    return std::max({rgb[0], rgb[1], rgb[2]}) >= picture_.clip;
  }

  bool shines(int x, int y) const {
    const Eigen::Vector3d seen = Eigen::Vector3f(picture_.rgb.pixel(x, y)).cast<double>();
    return luminance(seen) >=
           0.7 * luminance(fit_.fitted.radiance_in_sky(picture_.rays.direction(x + 0.5, y + 0.5)));
  }

  /// Reaches from pixels in facets of the fit and clipped ones of the sky to all that look like sky: windows
  /// hang in walls.
  void grow() {
    reached_.assign(likeness_.size(), 0);
    std::vector<std::size_t> queue;
    const auto reach = [&](std::size_t i) {
      if (reached_[i] || likeness_[i] == 0) return;
      reached_[i] = 1;
      if (likeness_[i] > 0.5f) queue.push_back(i);
    };
    for (std::size_t i = 0; i < likeness_.size(); ++i)
      if (likeness_[i] > 0.5f &&
          (fit_.used[facet_[i]] || fit_.beyond_model[facet_[i]] || fit_.clipped_sky[facet_[i]]))
        reach(i);
    for (std::size_t n = 0; n < queue.size(); ++n) for_each_neighbour(queue[n], reach);
  }

  bool is_sky(std::size_t i) const { return reached_[i] && likeness_[i] > 0.5f; }

  /// Goes on from the sky to pixels that look like the sky just beside them, where the model is at its end:
  /// low in gaps between houses, and in clouds.
  void follow() {
    if (!fit_.fitted.has_light()) return;
    step_ = std::max(1, static_cast<int>(std::lround(kFollowedStep / picture_.rays.pixel_angle())));
    find_noise();
    std::vector<std::size_t> queue;
    std::vector<std::uint8_t> waits(likeness_.size(), 0);
    const auto ask_around = [&](std::size_t i) {
      for_each_neighbour(i, [&](std::size_t n) {
        if (is_sky(n) || waits[n]) return;
        waits[n] = 1;
        queue.push_back(n);
      });
    };
    for (std::size_t i = 0; i < likeness_.size(); ++i)
      if (is_sky(i)) ask_around(i);
    for (std::size_t n = 0; n < queue.size(); ++n) {
      const std::size_t i = queue[n];
      waits[i] = 0;
      const float likeness =
          likeness_to_sky_around(static_cast<int>(i % width_), static_cast<int>(i / width_));
      if (!(likeness > 0.5f)) continue;
      likeness_[i] = likeness;
      reached_[i] = 1;
      ask_around(i);
    }
  }

  /// What pixels of the sky a step apart differ by, as a deviation of each: the median, over rows
  /// enough.
  void find_noise() {
    constexpr int kMostRows = 256;
    constexpr double kDeviation = 1.0484;  // of each, for a median of 1 of Gaussians' absolute difference
    const int stride = std::max(1, height_ / kMostRows);
    std::array<std::vector<double>, 3> differences;
    for (int y = 0; y < height_; y += stride)
      for (int x = step_; x < width_; ++x) {
        if (!is_sky(at(x, y)) || !is_sky(at(x - step_, y)) || clips(x, y) || clips(x - step_, y)) continue;
        const Eigen::Vector3d apart = relative_to(light(x, y), light(x - step_, y));
        for (int c = 0; c < 3; ++c) differences[c].push_back(std::abs(apart[c]));
      }
    for (int c = 0; c < 3; ++c)
      noise_[c] = std::clamp(kDeviation * median(differences[c]), kLeastPixelSigma, kMostStep);
  }

  Eigen::Vector3d light(int x, int y) const {
    return Eigen::Vector3f(picture_.rgb.pixel(x, y)).cast<double>();
  }
  /// Nearly the difference of logarithms where that is small.
  static Eigen::Vector3d relative_to(const Eigen::Vector3d& light, const Eigen::Vector3d& other) {
    return ((light - other).array() / other.array().max(kDarkest)).matrix();
  }

  /// Posterior of sky by the mean colour of the sky's pixels around, a step away: nearer ones lead up a
  /// blurred outline bit by bit.
  float likeness_to_sky_around(int x, int y) const {
    constexpr int kLeastCount = 2;
    if (!may_be_sky(x, y) || clips(x, y)) return 0;  // what clips is like all that clips
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (int v = y - step_; v <= y + step_; v += step_)
      for (int u = x - step_; u <= x + step_; u += step_)
        if (u >= 0 && v >= 0 && u < width_ && v < height_ && is_sky(at(u, v))) sum += light(u, v), ++count;
    if (count < kLeastCount) return 0;
    const double model = luminance(fit_.fitted.radiance_in_sky(picture_.rays.direction(x + 0.5, y + 0.5)));
    const double own = luminance(light(x, y));
    if (!(own >= kDarkestSky * model && own <= kBrightestSky * model)) return 0;
    return posterior(relative_to(light(x, y), sum / count), noise_);
  }

  const SkyPicture& picture_;
  const SkyFit& fit_;
  int width_, height_, last_facet_ = 0;
  std::vector<Eigen::Vector3d> correction_;
  Eigen::Vector3d pixel_sigma_ = Eigen::Vector3d::Zero();
  std::vector<float> likeness_;
  std::vector<int> facet_;
  std::vector<std::uint8_t> reached_;
  int step_ = 1;                                     ///< pixels
  Eigen::Vector3d noise_ = Eigen::Vector3d::Zero();  ///< relative
};

}  // namespace

Mask soft_sky_mask(const SkyPicture& picture, const SkyFit& fit) {
  const bool clips = std::find(fit.clipped_sky.begin(), fit.clipped_sky.end(), 1) != fit.clipped_sky.end();
  if (!fit.fitted.has_light() && !clips) return Mask(picture.rays.width(), picture.rays.height(), 0);
  return PixelMasking(picture, fit).take();
}

}  // namespace roxel

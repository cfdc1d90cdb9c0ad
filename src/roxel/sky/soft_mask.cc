#include <algorithm>
#include <cmath>

#include "roxel/sky/sky_fit.h"

namespace roxel {
namespace {

/// Density of log colour of what is not sky: alike over a factor of 50 in brightness and of 4 in hue.
constexpr double kElsewhere = 1 / (3.9 * 1.4 * 1.4);
/// A pixel is not a facet's mean: noise, thin cloud and blur are added to the model's deviation.
constexpr double kPixelSigma = 0.02;
constexpr int kReach = 8;  ///< facets that a correction is carried

class PixelMasking {
 public:
  PixelMasking(const SkyPicture& picture, const SkyFit& fit)
      : picture_(picture), fit_(fit), width_(picture.rays.width()), height_(picture.rays.height()) {}

  Mask take() {
    find_corrections();
    likeness_.assign(static_cast<std::size_t>(width_) * height_, 0.0f);
    facet_.assign(likeness_.size(), 0);
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) look(x, y);
    grow();
    Mask mask(width_, height_, 0);
    for (std::size_t i = 0; i < likeness_.size(); ++i)
      if (reached_[i]) mask.data()[i] = static_cast<std::uint8_t>(std::lround(255 * likeness_[i]));
    return mask;
  }

 private:
  std::size_t at(int x, int y) const { return static_cast<std::size_t>(y) * width_ + x; }

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
      const Eigen::Vector3d model = fit_.sky.radiance_in_sky(sphere.centre(f));
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

  /// Posterior of sky by colour alone.
  void look(int x, int y) {
    if (!picture_.valid.empty() && picture_.valid.at(x, y) != 255) return;
    const Eigen::Vector3d direction = picture_.rays.direction(x + 0.5, y + 0.5);
    if (direction.z() < 0) return;
    const FacetSphere& sphere = *fit_.light.sphere;
    if (!sphere.contains(last_facet_, direction)) last_facet_ = sphere.facet_at(direction);
    facet_[at(x, y)] = last_facet_;
    if (fit_.masks.near_sun[last_facet_] && shines(x, y)) {
      likeness_[at(x, y)] = 1;
      return;
    }
    const Eigen::Vector3d model =
        (fit_.sky.radiance_in_sky(direction).array() * correction_[last_facet_].array().exp()).matrix();
    double exponent = 0, density = 1;
    for (int c = 0; c < 3; ++c) {
      const double unrest = fit_.beyond_model[last_facet_] ? fit_.light.facets[last_facet_].contrast : 0;
      const double sigma = std::hypot(fit_.sky.relative_sigma[c], kPixelSigma, unrest);
      const double error = log_error(picture_.rgb.pixel(x, y)[c], model[c]) / sigma;
      exponent += 0.5 * error * error;
      density /= std::sqrt(2 * M_PI) * sigma;
    }
    const double sky = density * std::exp(-exponent);
    likeness_[at(x, y)] = static_cast<float>(sky / (sky + kElsewhere));
  }

  /// A clipped pixel says "at least this".
  double log_error(double seen, double model) const {
    if (seen >= picture_.clip && model >= picture_.clip) return 0;
    return std::log(std::max(seen, 1e-6 * model) / std::max(model, 1e-30));
  }

  bool shines(int x, int y) const {
    const Eigen::Vector3d seen = Eigen::Vector3f(picture_.rgb.pixel(x, y)).cast<double>();
    return luminance(seen) >=
           0.7 * luminance(fit_.sky.radiance_in_sky(picture_.rays.direction(x + 0.5, y + 0.5)));
  }

  /// Reaches from pixels in facets of the fit to all that look like sky: windows hang in walls.
  void grow() {
    reached_.assign(likeness_.size(), 0);
    std::vector<std::size_t> queue;
    const auto reach = [&](std::size_t i) {
      if (reached_[i] || likeness_[i] == 0) return;
      reached_[i] = 1;
      if (likeness_[i] > 0.5f) queue.push_back(i);
    };
    for (std::size_t i = 0; i < likeness_.size(); ++i)
      if (likeness_[i] > 0.5f && (fit_.used[facet_[i]] || fit_.beyond_model[facet_[i]])) reach(i);
    for (std::size_t n = 0; n < queue.size(); ++n) {
      const int x = static_cast<int>(queue[n] % width_), y = static_cast<int>(queue[n] / width_);
      for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}})
        if (x + dx >= 0 && y + dy >= 0 && x + dx < width_ && y + dy < height_) reach(at(x + dx, y + dy));
    }
  }

  const SkyPicture& picture_;
  const SkyFit& fit_;
  int width_, height_, last_facet_ = 0;
  std::vector<Eigen::Vector3d> correction_;
  std::vector<float> likeness_;
  std::vector<int> facet_;
  std::vector<std::uint8_t> reached_;
};

/// Where nothing of the sky is left to fit: what clips in facets that clip for the most part.
Mask clipped_mask(const SkyPicture& picture, const SkyFit& fit) {
  Mask mask(picture.rays.width(), picture.rays.height(), 0);
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x) {
      const float* rgb = picture.rgb.pixel(x, y);
      const Eigen::Vector3d direction = picture.rays.direction(x + 0.5, y + 0.5);
      if (direction.z() < 0 || std::max({rgb[0], rgb[1], rgb[2]}) < picture.clip) continue;
      const FacetLight& facet = fit.light.facets[fit.light.sphere->facet_at(direction)];
      if (facet.clipped > facet.weight) mask.at(x, y) = 255;
    }
  return mask;
}

}  // namespace

Mask soft_sky_mask(const SkyPicture& picture, const SkyFit& fit) {
  if (fit.sky.fallback == kClippedSky) return clipped_mask(picture, fit);
  if (!fit.sky.has_light()) return Mask(picture.rays.width(), picture.rays.height(), 0);
  return PixelMasking(picture, fit).take();
}

}  // namespace roxel

#include "roxel/sky/sphere_light.h"

#include <algorithm>
#include <cmath>

namespace roxel {
namespace {

constexpr double kPeakShare = 0.1;  ///< of a pixel or a facet: less that both share says little of either

}  // namespace

SphereLightSum::SphereLightSum(std::shared_ptr<const FacetSphere> sphere)
    : sphere_(std::move(sphere)), picture_(sphere_->count()), total_(sphere_->count()), parts_(*sphere_) {}

void SphereLightSum::add(const SkyPicture& picture) {
  const auto corners_of_row = [&](int y) {
    std::vector<Eigen::Vector3d> corners;
    for (int x = 0; x <= picture.rays.width(); ++x) corners.push_back(picture.rays.direction(x, y));
    return corners;
  };
  std::vector<Eigen::Vector3d> above = corners_of_row(0);
  for (int y = 0; y < picture.rays.height(); ++y) {
    const std::vector<Eigen::Vector3d> below = corners_of_row(y + 1);
    for (int x = 0; x < picture.rays.width(); ++x)
      if (picture.valid.empty() || picture.valid.at(x, y) == 255)
        add_pixel(picture, x, y, {above[x], above[x + 1], below[x + 1], below[x]});
    above = below;
  }
  ++pictures_;
  if (!picture.known_sky.empty()) ++masked_by_hand_;
  fold();
}

void SphereLightSum::add_pixel(const SkyPicture& picture, int x, int y,
                               const std::array<Eigen::Vector3d, 4>& corners) {
  const Eigen::Vector3d rgb = Eigen::Vector3f(picture.rgb.pixel(x, y)).cast<double>();
  const double light = luminance(rgb), solid_angle = picture.rays.solid_angle(x, y);
  const bool clipped = rgb.maxCoeff() >= picture.clip;
  const double open = picture.open.empty() ? 0 : picture.open.at(x, y) / 255.0;
  const double known = picture.known_sky.empty() ? 0 : picture.known_sky.at(x, y) / 255.0;
  for (const FacetPart& part : parts_.divide(corners)) {
    const double weight = solid_angle * part.share;
    Sum& sum = picture_[part.facet];
    if (sum.weight == 0 && sum.clipped == 0) touched_.push_back(part.facet);
    if (weight > kPeakShare * std::min(solid_angle, sphere_->solid_angle(part.facet)))
      sum.peak = std::max(sum.peak, light);
    sum.bright += light * weight * part.middle;
    sum.known_sky += known * weight;
    if (!picture.known_sky.empty()) sum.judged += weight;
    sum.open += open * weight;
    if (clipped) {
      sum.clipped += weight;
      sum.clipped_first += weight * rgb;
      sum.clip = picture.clip;
      continue;
    }
    sum.weight += weight;
    sum.first += weight * rgb;
    sum.second += weight * rgb.cwiseProduct(rgb);
    sum.luminance_second += weight * light * light;
    sum.pixels += part.share;
  }
}

void SphereLightSum::fold() {
  for (const int f : touched_) {
    const Sum& sum = picture_[f];
    Total& total = total_[f];
    total.weight += sum.weight;
    total.clipped += sum.clipped;
    total.clipped_first += sum.clipped_first;
    if (sum.clip > 0) total.clip = total.clip > 0 ? std::min(total.clip, sum.clip) : sum.clip;
    total.judged += sum.judged;
    total.known_sky += sum.known_sky;
    total.open += sum.open;
    total.pixels += sum.pixels;
    total.first += sum.first;
    total.second += sum.second;
    total.luminance_second += sum.luminance_second;
    total.peak = std::max(total.peak, sum.peak);
    total.bright += sum.bright;
    total.coverage =
        std::max(total.coverage, std::min(1.0, (sum.weight + sum.clipped) / sphere_->solid_angle(f)));
    ++total.pictures;
    if (sum.weight > 0) {
      const double mean = luminance(Eigen::Vector3d(sum.first / sum.weight));
      total.between_weight += sum.weight;
      total.between_first += sum.weight * mean;
      total.between_second += sum.weight * mean * mean;
    }
    picture_[f] = {};
  }
  touched_.clear();
}

SphereLight SphereLightSum::result() const {
  SphereLight light{sphere_, std::vector<FacetLight>(total_.size()), pictures_, masked_by_hand_};
  for (std::size_t f = 0; f < total_.size(); ++f) {
    const Total& total = total_[f];
    FacetLight& facet = light.facets[f];
    facet.weight = total.weight;
    facet.clipped = total.clipped;
    if (total.clipped > 0) facet.clipped_mean = total.clipped_first / total.clipped;
    facet.clip = total.clip;
    facet.judged = total.judged;
    facet.known_sky = total.known_sky;
    facet.open = total.open;
    facet.coverage = total.coverage;
    facet.pixels = total.pixels;
    facet.pictures = total.pictures;
    facet.peak = total.peak;
    facet.bright = total.bright;
    if (!(total.weight > 0)) continue;
    facet.mean = total.first / total.weight;
    facet.variance =
        (total.second / total.weight - facet.mean.cwiseProduct(facet.mean)).cwiseMax(Eigen::Vector3d::Zero());
    const double mean = luminance(facet.mean);
    const auto relative = [&](double second) {
      return mean > 0 ? std::sqrt(std::max(0.0, second - mean * mean)) / mean : 0.0;
    };
    facet.contrast = relative(total.luminance_second / total.weight);
    facet.disagreement = relative(total.between_second / total.between_weight);
  }
  return light;
}

}  // namespace roxel

#include "roxel/eval/volume_accuracy.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/error.h"
#include "roxel/volume/saved_voxels.h"

namespace roxel {
namespace {

double ratio(double part, double whole) { return whole > 0 ? part / whole : 0.0; }

}  // namespace

SavedVoxels saved_voxels(const Volume& volume, float opacity_threshold, float confidence_threshold) {
  SavedVoxels saved;
  for_each_saved_voxel(volume, opacity_threshold, confidence_threshold,
                       [&](std::uint32_t, const Eigen::Vector3d& centre, float opacity) {
                         saved.centres.push_back(centre);
                         saved.opacity.push_back(opacity);
                       });
  return saved;
}

void DistanceHistogram::add(double distance, double opacity) {
  const int bin = static_cast<int>(std::min(distance / kBinVoxels, static_cast<double>(kBins)));
  ++voxels[bin];
  opacity_sum[bin] += opacity;
}

double DistanceHistogram::mean_opacity(int bin) const {
  return ratio(opacity_sum[bin], static_cast<double>(voxels[bin]));
}

double VolumeAccuracy::share_close() const {
  return ratio(static_cast<double>(close_voxels), static_cast<double>(voxels));
}
double VolumeAccuracy::weighted_mean_opacity() const { return ratio(weighted_opacity, weight); }
double VolumeAccuracy::share_covered() const {
  return ratio(static_cast<double>(covered_points), static_cast<double>(seen_points));
}

VolumeAccuracy volume_accuracy(const std::vector<float>& opacity, const std::vector<double>& to_truth,
                               const std::vector<double>& to_voxel) {
  ROXEL_CHECK_EQ(opacity.size(), to_truth.size());
  VolumeAccuracy accuracy;
  accuracy.voxels = static_cast<std::int64_t>(opacity.size());
  for (std::size_t i = 0; i < opacity.size(); ++i) {
    accuracy.histogram.add(to_truth[i], opacity[i]);
    if (!(to_truth[i] <= VolumeAccuracy::kClose)) continue;
    const double weight = 1 - to_truth[i] / VolumeAccuracy::kClose;
    ++accuracy.close_voxels;
    accuracy.weight += weight;
    accuracy.weighted_opacity += weight * opacity[i];
  }
  accuracy.seen_points = static_cast<std::int64_t>(to_voxel.size());
  accuracy.covered_points =
      std::count_if(to_voxel.begin(), to_voxel.end(), [](double d) { return d <= VolumeAccuracy::kCover; });
  return accuracy;
}

}  // namespace roxel

#pragma once
/// A volume's voxels against the true surface, as [Jethwa04] tables 8.1 to 8.4 and figures 8.6 and 8.12 have
/// it. Distances are in voxel lengths, from a voxel's centre to the nearest place on the true surface (the
/// thesis: to the nearest voxel of the true surface's own voxels, which differs by up to half a voxel's
/// diagonal).

#include <array>
#include <vector>

#include "roxel/volume/volume.h"

namespace roxel {

/// Voxels of lattice 0 at or above both thresholds.
struct SavedVoxels {
  std::vector<Eigen::Vector3d> centres;  ///< world
  std::vector<float> opacity;
};
SavedVoxels saved_voxels(const Volume& volume, float opacity_threshold, float confidence_threshold);

/// Voxels by their distance from the true surface.
struct DistanceHistogram {
  static constexpr double kBinVoxels = 0.5;
  static constexpr int kBins = 20;               ///< up to 10 voxels; one more takes the rest
  std::array<std::int64_t, kBins + 1> voxels{};  ///< [0, 0.5), [0.5, 1), ...
  std::array<double, kBins + 1> opacity_sum{};   ///< of the voxels in each bin

  void add(double distance, double opacity);
  double mean_opacity(int bin) const;  ///< 0 without voxels
};

struct VolumeAccuracy {
  static constexpr double kClose = 4;  ///< voxels; the thesis's "close to the surface"
  static constexpr double kCover = 1;  ///< voxels within which a place on the surface is covered

  std::int64_t voxels = 0;
  std::int64_t close_voxels = 0;
  double weighted_opacity = 0;      ///< sum a (1 - d/4) over close voxels ...
  double weight = 0;                ///< ... and sum (1 - d/4)
  std::int64_t seen_points = 0;     ///< places on the true surface that two views see
  std::int64_t covered_points = 0;  ///< those with the centre of a saved voxel within kCover
  DistanceHistogram histogram;

  double share_close() const;            ///< [0, 1]
  double weighted_mean_opacity() const;  ///< [0, 1]
  double share_covered() const;          ///< [0, 1]
};

/// `to_truth`: of each saved voxel; `to_voxel`: of each seen place to the nearest saved voxel's centre; both
/// in voxels.
VolumeAccuracy volume_accuracy(const std::vector<float>& opacity, const std::vector<double>& to_truth,
                               const std::vector<double>& to_voxel);

}  // namespace roxel

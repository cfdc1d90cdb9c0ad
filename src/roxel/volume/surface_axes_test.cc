#include "roxel/volume/surface_axes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace roxel {
namespace {

/// A cube of 24 voxels a side whose opacity is of the signed distance from a plane through its middle.
template <class Opacity>
Volume plane_world(const Eigen::Vector3d& normal, Opacity&& opacity) {
  const LatticeFrame frame{Eigen::Vector3d::Zero(), 1, Eigen::Vector3i::Constant(3)};
  Topology topology(frame);
  for (int k = 0; k < 24; ++k)
    for (int j = 0; j < 24; ++j)
      for (int i = 0; i < 24; ++i) topology.insert({i, j, k});
  Volume volume({topology});
  volume.resize_channels();
  for (int k = 0; k < 24; ++k)
    for (int j = 0; j < 24; ++j)
      for (int i = 0; i < 24; ++i) {
        const double d = (frame.voxel_centre({i, j, k}) - Eigen::Vector3d::Constant(12)).dot(normal);
        volume.tau[volume.index(0).slot({i, j, k})] = tau_from_alpha(static_cast<float>(opacity(d)));
      }
  return volume;
}

double largest_angle_deg(const Volume& volume, const Eigen::Vector3d& normal, double reach) {
  const std::vector<Eigen::Vector3f> axes = surface_axes(volume, 2);
  double least_cosine = 1;
  for (int k = 6; k < 18; ++k)
    for (int j = 6; j < 18; ++j)
      for (int i = 6; i < 18; ++i) {
        const Eigen::Vector3d x = volume.index(0).frame().voxel_centre({i, j, k});
        if (std::abs((x - Eigen::Vector3d::Constant(12)).dot(normal)) > reach) continue;
        const Eigen::Vector3f axis = axes[volume.index(0).slot({i, j, k})];
        least_cosine = std::min(least_cosine, std::abs(axis.cast<double>().dot(normal)));
      }
  return std::acos(std::min(1.0, least_cosine)) * 180 / M_PI;
}

const Eigen::Vector3d kNormals[] = {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 2, 0.5).normalized(),
                                    Eigen::Vector3d(-1, 1, 1).normalized()};

TEST(SurfaceAxes, OfASolidAreItsNormals) {
  for (const Eigen::Vector3d& normal : kNormals) {
    const Volume volume = plane_world(normal, [](double d) { return d < 0 ? 0.9 : 0.0; });
    EXPECT_LT(largest_angle_deg(volume, normal, 0.9), 5) << normal.transpose();
  }
}

TEST(SurfaceAxes, OfAThinSheetAreItsNormals) {
  for (const Eigen::Vector3d& normal : kNormals) {
    const Volume volume = plane_world(normal, [](double d) { return std::abs(d) < 0.6 ? 0.9 : 0.0; });
    EXPECT_LT(largest_angle_deg(volume, normal, 0.6), 6) << normal.transpose();
  }
}

TEST(SurfaceAxes, AreZeroWhereNothingChanges) {
  const Volume volume = plane_world({0, 0, 1}, [](double) { return 0.0; });
  for (const Eigen::Vector3f& axis : surface_axes(volume, 1)) EXPECT_EQ(axis, Eigen::Vector3f::Zero().eval());
}

TEST(SurfaceAxes, DoNotDependOnThreads) {
  const Volume volume = plane_world(kNormals[1], [](double d) { return d < 0 ? 0.5 : 0.01; });
  EXPECT_EQ(surface_axes(volume, 1), surface_axes(volume, 4));
}

}  // namespace
}  // namespace roxel

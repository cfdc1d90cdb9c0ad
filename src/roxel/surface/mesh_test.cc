#include "roxel/surface/mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace roxel {
namespace {

/// Two triangles of areas 2 and 6 in the plane z = 1, apart from each other.
Mesh two_triangles() {
  Mesh mesh;
  mesh.points = {{0, 0, 1}, {2, 0, 1}, {0, 2, 1}, {10, 0, 1}, {14, 0, 1}, {10, 3, 1}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  return mesh;
}

TEST(Mesh, AreaIsTheSumOfItsTriangles) { EXPECT_DOUBLE_EQ(surface_area(two_triangles()), 8); }

TEST(Mesh, SamplesAreUniformByArea) {
  SurfaceSampling options;
  options.count = 40000;
  const auto samples = sample_surface(two_triangles(), options);
  ASSERT_EQ(samples.size(), 40000);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  int in_small = 0;
  for (const Eigen::Vector3d& x : samples) {
    EXPECT_DOUBLE_EQ(x.z(), 1);
    if (x.x() > 5) continue;
    ++in_small;
    EXPECT_LE(x.x() + x.y(), 2 + 1e-12);
    mean += x;
  }
  EXPECT_NEAR(in_small / 40000.0, 0.25, 0.01);  // standard error 0.0022
  // The centroid of the small one is (2/3, 2/3); standard error of the mean 0.005.
  EXPECT_NEAR(mean.x() / in_small, 2 / 3.0, 0.02);
  EXPECT_NEAR(mean.y() / in_small, 2 / 3.0, 0.02);
}

TEST(Mesh, SamplesKeepToTheBoxAndTheSeed) {
  SurfaceSampling options;
  options.count = 1000;
  options.box = Eigen::AlignedBox3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.5, 0.5, 2));
  const auto samples = sample_surface(two_triangles(), options);
  EXPECT_EQ(samples.size(), 1000);
  for (const Eigen::Vector3d& x : samples) EXPECT_TRUE(options.box.contains(x));
  EXPECT_EQ(samples, sample_surface(two_triangles(), options));
  options.seed = 2;
  EXPECT_NE(samples, sample_surface(two_triangles(), options));
}

TEST(Mesh, NoSurfaceInTheBoxGivesNoSamples) {
  SurfaceSampling options;
  options.count = 10;
  // It meets the bounds of a triangle, but no point of it.
  options.box = Eigen::AlignedBox3d(Eigen::Vector3d(1.9, 1.9, 0), Eigen::Vector3d(2, 2, 2));
  EXPECT_TRUE(sample_surface(two_triangles(), options).empty());
  EXPECT_TRUE(sample_surface({}, {}).empty());
}

TEST(Mesh, OnePointOfEachCellIsKept) {
  const std::vector<Eigen::Vector3d> points{
      {0.1, 0, 0}, {0.2, 0, 0}, {0.6, 0, 0}, {-0.1, 0, 0}, {0.3, 0.9, 0}};
  const std::vector<Eigen::Vector3d> kept{{0.1, 0, 0}, {0.6, 0, 0}, {-0.1, 0, 0}, {0.3, 0.9, 0}};
  EXPECT_EQ(one_point_a_cell(points, 0.5), kept);
}

TEST(Mesh, AnEmptyBoxTakesAllPoints) {
  const std::vector<Eigen::Vector3d> points{{0, 0, 0}, {3, 0, 0}};
  EXPECT_EQ(points_in_box(points, {}), points);
  EXPECT_EQ(points_in_box(points, {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)}).size(), 1);
}

}  // namespace
}  // namespace roxel

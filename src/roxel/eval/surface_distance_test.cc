#include "roxel/eval/surface_distance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace roxel {
namespace {

using Eigen::Vector3d;

TEST(SurfaceDistance, ToATriangleByHand) {
  const Vector3d a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
  EXPECT_EQ(closest_on_triangle({0.5, 0.5, 3}, a, b, c), Vector3d(0.5, 0.5, 0));
  EXPECT_EQ(closest_on_triangle({1, -2, 1}, a, b, c), Vector3d(1, 0, 0));
  EXPECT_EQ(closest_on_triangle({-1, -1, 0}, a, b, c), a);
  EXPECT_EQ(closest_on_triangle({5, -1, 0}, a, b, c), b);
  EXPECT_NEAR((closest_on_triangle({2, 2, 1}, a, b, c) - Vector3d(1, 1, 0)).norm(), 0, 1e-15);
  // Corners that coincide: a segment, a point.
  EXPECT_EQ(closest_on_triangle({1, 1, 0}, a, b, b), Vector3d(1, 0, 0));
  EXPECT_EQ(closest_on_triangle({7, 1, 0}, b, b, b), b);
}

/// Random triangles in the unit cube, far from the origin.
Mesh soup(int count, const Vector3d& centre) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  Mesh mesh;
  for (std::uint32_t t = 0; t < static_cast<std::uint32_t>(count); ++t) {
    const Vector3d corner(uniform(rng), uniform(rng), uniform(rng));
    for (int k = 0; k < 3; ++k)
      mesh.points.push_back(centre + corner + 0.1 * Vector3d(uniform(rng), uniform(rng), uniform(rng)));
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  return mesh;
}

double plain_distance(const Mesh& mesh, const Vector3d& x) {
  double nearest = 1e300;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d on = closest_on_triangle(x, mesh.points[a], mesh.points[b], mesh.points[c]);
    nearest = std::min(nearest, (on - x).norm());
  }
  return nearest;
}

TEST(SurfaceDistance, AgreesWithLookingAtEveryTriangle) {
  const Vector3d centre(1e5, -2e5, 3e4);  // map coordinates, where floats are good to a hundredth
  const Mesh mesh = soup(300, centre);
  const SurfaceDistance distance(mesh);
  std::mt19937 rng(4);
  std::uniform_real_distribution<double> uniform(-0.5, 1.5);
  for (int i = 0; i < 500; ++i) {
    const Vector3d x = centre + Vector3d(uniform(rng), uniform(rng), uniform(rng));
    EXPECT_NEAR(distance(x), plain_distance(mesh, x), 1e-9);
  }
}

TEST(SurfaceDistance, ToPointsWhereThereAreNoTriangles) {
  const SurfaceDistance distance(Mesh{{{0, 0, 0}, {10, 0, 0}}, {}});
  EXPECT_DOUBLE_EQ(distance({7, 4, 0}), 5);
  EXPECT_EQ(distance({7, 4, 0}, 4.9), std::numeric_limits<double>::infinity());
  EXPECT_DOUBLE_EQ(distance({7, 4, 0}, 5.1), 5);
}

TEST(SurfaceDistance, ToNothingIsInfinite) {
  EXPECT_EQ(SurfaceDistance(Mesh{})({1, 2, 3}), std::numeric_limits<double>::infinity());
}

TEST(SurfaceDistance, DoesNotDependOnThreads) {
  const Mesh mesh = soup(200, Vector3d::Zero());
  const SurfaceDistance distance(mesh);
  const std::vector<Vector3d> points = sample_surface(soup(50, {0.2, 0, 0}), {5000, 1, {}});
  EXPECT_EQ(distance.of(points, 1), distance.of(points, 4));
}

}  // namespace
}  // namespace roxel

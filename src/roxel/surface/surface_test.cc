#include "roxel/surface/surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "roxel/base/error.h"
#include "roxel/surface/mesh_rays.h"
#include "roxel/surface/simplification.h"
#include "roxel/surface/surface_fixture.h"
#include "roxel/surface/volume_colors.h"

namespace roxel {
namespace {

using Eigen::Vector3d;

/// Two triangles that share the edge 1-2, and one apart.
Surface three_triangles() {
  Surface s;
  s.mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}};
  s.mesh.triangles = {{0, 1, 2}, {1, 3, 2}, {4, 5, 6}};
  s.normals.assign(7, Eigen::Vector3f::UnitZ());
  return s;
}

TEST(Surface, NormalsOfABallAreItsRadii) {
  const Surface ball = fixture::ball_mesh(12);
  // Points of the cube's edges belong to one side alone: off by up to the angle of a square.
  for (std::size_t i = 0; i < ball.mesh.points.size(); ++i)
    EXPECT_GT(ball.normals[i].cast<double>().dot(ball.mesh.points[i]), 0.99);
}

TEST(Surface, KeepingTrianglesDropsPointsThatNobodyUses) {
  const Surface kept = kept_triangles(three_triangles(), {0, 0, 1});
  EXPECT_THAT(kept.mesh.points,
              testing::ElementsAre(Vector3d(5, 0, 0), Vector3d(6, 0, 0), Vector3d(5, 1, 0)));
  EXPECT_EQ(kept.normals.size(), 3u);
  EXPECT_EQ(kept.mesh.triangles[0], (std::array<std::uint32_t, 3>{0, 1, 2}));
}

TEST(Surface, PartsHangTogetherByPoints) {
  const Components all = connected_components(three_triangles().mesh);
  EXPECT_EQ(all.count, 2u);
  EXPECT_THAT(all.of_triangle, testing::ElementsAre(0, 0, 1));
  const Components some = connected_components(three_triangles().mesh, {0, 1, 1});
  EXPECT_THAT(some.of_triangle, testing::ElementsAre(kNoComponent, 0, 1));
}

TEST(Surface, NeighboursLieAcrossEdges) {
  const auto neighbours = face_neighbours(three_triangles().mesh);
  EXPECT_THAT(neighbours[0], testing::ElementsAre(-1, 1, -1));
  EXPECT_THAT(neighbours[1], testing::ElementsAre(-1, -1, 0));
  EXPECT_THAT(neighbours[2], testing::Each(-1));
}

TEST(Simplification, ReachesItsTargetAndKeepsTheShape) {
  const Surface ball = fixture::ball_mesh(20);
  const Surface fewer = simplified(ball, {1000, 0});
  EXPECT_LE(fewer.mesh.triangles.size(), 1000u);
  EXPECT_GT(fewer.mesh.triangles.size(), 600u);
  EXPECT_EQ(fewer.colors.size(), fewer.mesh.points.size());
  EXPECT_NEAR(surface_area(fewer.mesh), surface_area(ball.mesh), 0.05 * surface_area(ball.mesh));
}

TEST(Simplification, TheErrorBoundsIt) {
  const Surface ball = fixture::ball_mesh(20);
  const auto count = [&](double error) {
    return simplified(ball, {std::nullopt, error}).mesh.triangles.size();
  };
  EXPECT_GT(count(0.001), count(0.01));
  EXPECT_GT(count(0.01), count(0.1));
  for (const double error : {0.001, 0.01}) {
    const Surface fewer = simplified(ball, {std::nullopt, error});
    const MeshRays rays(fewer.mesh);
    double square = 0, worst = 0;
    int hits = 0;
    for (const Vector3d& x : ball.mesh.points) {
      const auto hit = rays.trace({0, 0, 0}, x);
      if (!hit) continue;  // between two sides of the cube that the ball was made of
      ++hits;
      const double off = std::abs(1 - hit->distance);
      square += off * off;
      worst = std::max(worst, off);
    }
    EXPECT_GT(hits, 0.8 * static_cast<double>(ball.mesh.points.size()));
    EXPECT_LT(std::sqrt(square / hits), error);
    EXPECT_LT(worst, 2 * error);
  }
  EXPECT_EQ(simplified(ball, {1000000, 0}).mesh.triangles.size(), ball.mesh.triangles.size());
}

TEST(MeshRays, HitAndSeeAsGeometrySays) {
  const Surface ball = fixture::ball_mesh(30);
  const MeshRays rays(ball.mesh);
  const auto hit = rays.trace({3, 0.1, 0.2}, {-1, 0, 0});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance, 3 - std::sqrt(1 - 0.05), 0.01);
  Vector3d at = Vector3d::Zero();
  for (int k = 0; k < 3; ++k) at += hit->corners[k] * ball.mesh.points[ball.mesh.triangles[hit->triangle][k]];
  EXPECT_LT((at - Vector3d(3 - hit->distance, 0.1, 0.2)).norm(), 1e-5);
  EXPECT_FALSE(rays.trace({3, 2, 0}, {-1, 0, 0}));
  EXPECT_TRUE(rays.sees({3, 0, 0}, {1.01, 0, 0}, 0.001));
  EXPECT_FALSE(rays.sees({3, 0, 0}, {-1, 0, 0}, 0.001));
}

TEST(MeshPicture, ABallFillsItsOrbitPicture) {
  const Surface ball = fixture::ball_mesh(30);
  const MeshRays rays(ball.mesh);
  const PinholeCamera camera = orbit_camera(Vector3d::Zero(), 1, {1, 2, 0.5}, Vector3d::UnitZ(), 64);
  const Image shaded = shaded_picture(ball, rays, camera, {1, 2});
  const Image colored = colored_picture(rays, camera, point_colors(ball), {1, 2});
  const float background = MeshPictureOptions{}.background[2];
  const auto is_background = [&](const Image& picture, int x, int y) {
    return picture.pixel(x, y)[2] == background;
  };
  EXPECT_TRUE(is_background(shaded, 1, 1));
  EXPECT_FALSE(is_background(shaded, 2, 32));
  EXPECT_FALSE(is_background(shaded, 61, 32));
  const Ray middle = camera.ray(32.5, 32.5);
  const Rgb expected = fixture::color_at(middle.origin + *fixture::meet_ball(middle) * middle.direction);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(colored.pixel(32, 32)[c], srgb_encode(expected[c]), 0.02);
  // Lit from the viewer's upper left.
  EXPECT_GT(shaded.pixel(20, 16)[0], shaded.pixel(44, 48)[0] + 0.2f);
}

TEST(VolumeColors, AreThoseOfOpaqueVoxelsNearby) {
  Topology topology({Vector3d::Zero(), 0.5, {1, 1, 1}});
  topology.insert({2, 2, 2});
  topology.insert({4, 2, 2});
  Volume volume({topology});
  volume.resize_channels();
  const ColorTransform linear(ColorSpace::kRgb);
  for (std::uint32_t slot = 0; slot < 2; ++slot) {
    volume.tau[slot] = 2;
    volume.color_weight[slot] = 1;
    volume.color_mean[slot] = slot == 0 ? std::array{0.8f, 0.1f, 0.1f} : std::array{0.1f, 0.1f, 0.8f};
  }
  const auto colors = volume_colors({{1.25, 1.25, 1.25}, {1.75, 1.25, 1.25}, {9, 9, 9}}, volume, linear, 2);
  EXPECT_NEAR(colors[0][0], 0.8, 0.02);
  EXPECT_NEAR(colors[1][0], 0.45, 0.01);
  EXPECT_NEAR(colors[1][2], 0.45, 0.01);
  EXPECT_EQ(colors[2][0], 0.5f);
  volume.tau[1] = 0;  // clear: its colour does not count
  EXPECT_NEAR(volume_colors({{1.75, 1.25, 1.25}}, volume, linear, 1)[0][0], 0.8, 1e-5);
}

}  // namespace
}  // namespace roxel

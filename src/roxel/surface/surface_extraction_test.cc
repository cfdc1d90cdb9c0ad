#include "roxel/surface/surface_extraction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "roxel/surface/surface_fixture.h"

namespace roxel {
namespace {

using Eigen::Vector3d;

/// The ball without what lies within `angle` of +z, in every view.
std::vector<FusionView> ball_with_hole(double angle) {
  std::vector<FusionView> views;
  for (const PinholeCamera& camera : fixture::cameras_around()) {
    FusionView view = fixture::ball_view(camera);
    for (int y = 0; y < view.depth.height(); ++y)
      for (int x = 0; x < view.depth.width(); ++x) {
        const Ray ray = camera.ray(x + 0.5, y + 0.5);
        const Vector3d at = ray.origin + *view.depth.pixel(x, y) * ray.direction;
        if (*view.depth.pixel(x, y) > 0 && at.z() > std::cos(angle)) *view.depth.pixel(x, y) = 0;
      }
    views.push_back(std::move(view));
  }
  return views;
}

Extraction extracted(const std::vector<FusionView>& views, const ExtractionOptions& options,
                     double half_box = 1.5) {
  FusionOptions fusion = fixture::ball_fusion(half_box);
  fusion.hole_size = options.hole_size;
  RunContext context(2);
  return extract_surface(
      fuse_depth(
          static_cast<int>(views.size()), [&](int v) { return views[v]; }, fusion, context),
      options);
}

int open_edges(const Mesh& mesh) {
  int open = 0;
  for (const auto& around : face_neighbours(mesh)) open += std::count(around.begin(), around.end(), -1);
  return open;
}

TEST(SurfaceExtraction, ABallIsClosedAndItsOutsideIsOut) {
  const Surface surface = extracted(ball_with_hole(0), {}).surface;
  ASSERT_GT(surface.mesh.triangles.size(), 1000u);
  EXPECT_EQ(open_edges(surface.mesh), 0);
  for (const Vector3d& x : surface.mesh.points) EXPECT_NEAR(x.norm(), 1, 0.04);
  for (const auto& [a, b, c] : surface.mesh.triangles) {
    const Vector3d normal = (surface.mesh.points[b] - surface.mesh.points[a])
                                .cross(surface.mesh.points[c] - surface.mesh.points[a]);
    EXPECT_GT(normal.dot(surface.mesh.points[a]), -1e-6);
  }
}

TEST(SurfaceExtraction, TrianglesAreRegularAndTheirPointsOnTheSurface) {
  const Mesh mesh = extracted(ball_with_hole(0), {}).surface.mesh;
  double square_error = 0, quality = 0, worst = 1;
  for (const Vector3d& x : mesh.points) square_error += (x.norm() - 1) * (x.norm() - 1);
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d p = mesh.points[b] - mesh.points[a], q = mesh.points[c] - mesh.points[a];
    // 1 where all sides are alike, 0 for a sliver.
    const double own =
        2 * std::sqrt(3.0) * p.cross(q).norm() / (p.squaredNorm() + q.squaredNorm() + (p - q).squaredNorm());
    quality += own / static_cast<double>(mesh.triangles.size());
    worst = std::min(worst, own);
  }
  EXPECT_LT(std::sqrt(square_error / static_cast<double>(mesh.points.size())), 0.008);  // a tenth of a step
  EXPECT_GT(quality, 0.88);
  EXPECT_GT(worst, 0.3);
}

TEST(SurfaceExtraction, NothingIsInventedWhereNobodyLooked) {
  // From +x alone: half a ball at most, open at its rim.
  std::vector<FusionView> views;
  for (const PinholeCamera& camera : fixture::cameras_around())
    if (camera.pose.centre.x() > 0) views.push_back(fixture::ball_view(camera));
  const Extraction extraction = extracted(views, {});
  EXPECT_GT(open_edges(extraction.surface.mesh), 20);
  EXPECT_GT(extraction.unsupported, 0);
  for (const Vector3d& x : extraction.surface.mesh.points) EXPECT_NEAR(x.norm(), 1, 0.15);
}

TEST(SurfaceExtraction, SmallHolesAreClosedAndLargeOnesStayOpen) {
  ExtractionOptions options;
  options.hole_size = 0;
  EXPECT_GT(open_edges(extracted(ball_with_hole(0.3), options).surface.mesh), 10);
  options.hole_size = 12;
  const Extraction closed = extracted(ball_with_hole(0.3), options);
  EXPECT_EQ(open_edges(closed.surface.mesh), 0);
  EXPECT_GT(closed.closed, 10);
  for (const Vector3d& x : closed.surface.mesh.points) EXPECT_NEAR(x.norm(), 1, 0.12);
  EXPECT_GT(open_edges(extracted(ball_with_hole(0.9), options).surface.mesh), 10);
}

TEST(SurfaceExtraction, ASmallPartGoesAndTheLargeOneStays) {
  const Vector3d centre(0, 0, 1.8);  // of a crumb beside the ball, 5 lattice steps across
  const double radius = 0.2;
  std::vector<FusionView> views;
  for (const PinholeCamera& camera : fixture::cameras_around(8, 192, 2.2)) {
    FusionView view = fixture::ball_view(camera);
    for (int y = 0; y < view.depth.height(); ++y)
      for (int x = 0; x < view.depth.width(); ++x)
        if (const auto t = fixture::meet_ball(camera.ray(x + 0.5, y + 0.5), centre, radius)) {
          float& depth = *view.depth.pixel(x, y);
          depth = depth > 0 ? std::min(depth, static_cast<float>(*t)) : static_cast<float>(*t);
          *view.opacity.pixel(x, y) = 1;
        }
    views.push_back(std::move(view));
  }
  const auto near_crumb = [&](const Mesh& mesh) {
    return std::count_if(mesh.points.begin(), mesh.points.end(),
                         [&](const Vector3d& x) { return (x - centre).norm() < 1.5 * radius; });
  };
  ExtractionOptions options;
  options.smallest_part = 3;
  const Extraction both = extracted(views, options, 2.2);
  EXPECT_GT(near_crumb(both.surface.mesh), 30);
  EXPECT_EQ(both.debris, 0);

  options.smallest_part = 10;
  const Extraction large = extracted(views, options, 2.2);
  EXPECT_EQ(near_crumb(large.surface.mesh), 0);
  EXPECT_GT(large.debris, 30);
  EXPECT_EQ(large.surface.mesh.triangles.size() + large.debris, both.surface.mesh.triangles.size());
  EXPECT_EQ(open_edges(large.surface.mesh), 0);
  EXPECT_GT(large.surface.mesh.triangles.size(), 1000u);
}

TEST(SurfaceExtraction, WhatOneViewAloneSeesIsLeftOut) {
  std::vector<FusionView> views = ball_with_hole(0);
  for (int y = 14; y < 26; ++y)
    for (int x = 14; x < 26; ++x) {  // a speck beside the ball, in the first view
      *views[0].depth.pixel(x, y) = 3.6f;
      *views[0].opacity.pixel(x, y) = 1;
    }
  for (FusionView& view : views)
    for (float& a : view.opacity.data()) a = 1;  // so that empty rays do not carve it away
  const auto farthest = [&](int min_views) {
    double far = 0;
    ExtractionOptions options;
    options.min_views = min_views;
    options.smallest_part = options.hole_size = 0;
    for (const Vector3d& x : extracted(views, options).surface.mesh.points) far = std::max(far, x.norm());
    return far;
  };
  EXPECT_GT(farthest(1), 1.38);
  EXPECT_LT(farthest(2), 1.34);  // the ball, what counts as support of it, and a cell
}

TEST(SurfaceExtraction, SmallPartsAreLeftOut) {
  ExtractionOptions options;
  options.smallest_part = 30;  // the ball is 25 steps wide
  const Extraction extraction = extracted(ball_with_hole(0), options);
  EXPECT_TRUE(extraction.surface.mesh.triangles.empty());
  EXPECT_GT(extraction.debris, 1000);
}

}  // namespace
}  // namespace roxel

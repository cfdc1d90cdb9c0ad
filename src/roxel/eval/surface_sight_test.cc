#include "roxel/eval/surface_sight.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace roxel {
namespace {

using Eigen::Vector3d;

/// 10 x 10 pixels, 53 degrees wide, looking along +z.
PinholeCamera camera_at(const Vector3d& centre) {
  PinholeCamera camera;
  camera.intrinsics = {10, 10, 10, 10, 5, 5, 0};
  camera.pose.centre = centre;
  return camera;
}

/// A wall at depth 5, and one at 2 that hides its left half from the origin.
Mesh two_walls() {
  return {{{-9, -9, 5}, {9, -9, 5}, {9, 9, 5}, {-9, 9, 5}, {-9, -9, 2}, {0, -9, 2}, {0, 9, 2}, {-9, 9, 2}},
          {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}}};
}

TEST(SurfaceSight, OfWhatIsHiddenBehindOrOutside) {
  const std::vector<Vector3d> points{{1, 0, 5},     // seen
                                     {-1, 0, 5},    // hidden by the near wall
                                     {-0.4, 0, 2},  // on the near wall
                                     {4, 0, 5},     // outside the image
                                     {1, 0, -5},    // behind the camera
                                     {1, 0, 5.1}};  // behind the far wall
  const std::vector<PinholeCamera> cameras{camera_at({0, 0, 0})};
  EXPECT_THAT(count_sightings(two_walls(), points, cameras, 1), testing::ElementsAre(1, 0, 1, 0, 0, 0));
}

TEST(SurfaceSight, CountsCamerasAndNotThreads) {
  const std::vector<Vector3d> points{{1, 0, 5}, {-1, 0, 5}};
  const std::vector<PinholeCamera> cameras{camera_at({0, 0, 0}), camera_at({0.5, 0, 0}),
                                           camera_at({-1, 0, 3})};
  for (const int threads : {1, 3})
    EXPECT_THAT(count_sightings(two_walls(), points, cameras, threads), testing::ElementsAre(2, 1));
}

TEST(SurfaceSight, NeitherDistanceNorOriginHidesASurfaceFromItself) {
  const Vector3d far(1e5, -2e5, 3e4);
  Mesh mesh = two_walls();
  for (Vector3d& x : mesh.points) x += far;
  const std::vector<Vector3d> points =
      sample_surface(mesh, {2000, 1, {far + Vector3d(1, -2, 4.9), far + Vector3d(2, 2, 5.1)}});
  ASSERT_EQ(points.size(), 2000);
  const std::vector<PinholeCamera> cameras{camera_at(far)};
  EXPECT_THAT(count_sightings(mesh, points, cameras, 1), testing::Each(1));
}

TEST(SurfaceSight, WithoutASurfaceNothingHides) {
  const std::vector<PinholeCamera> cameras{camera_at({0, 0, 0})};
  EXPECT_THAT(count_sightings({}, std::vector<Vector3d>{{0, 0, 3}}, cameras, 1), testing::ElementsAre(1));
}

}  // namespace
}  // namespace roxel

#include "roxel/camera/frustum.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace roxel {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

/// Looks along +z from the origin, 90 degrees wide and high.
PinholeCamera square_camera() {
  PinholeCamera camera;
  camera.intrinsics = {100, 100, 50, 50, 50, 50, 0};
  return camera;
}

TEST(Frustum, CornersLieOnTheEdgesOfTheImage) {
  const auto corners = frustum_corners(square_camera(), {1, 3});
  EXPECT_EQ(corners[0], Vector3d(-1, -1, 1));
  EXPECT_EQ(corners[1], Vector3d(1, -1, 1));
  EXPECT_EQ(corners[2], Vector3d(1, 1, 1));
  EXPECT_EQ(corners[3], Vector3d(-1, 1, 1));
  EXPECT_EQ(corners[4], Vector3d(-3, -3, 3));
  EXPECT_EQ(corners[6], Vector3d(3, 3, 3));
}

TEST(Frustum, SeesPointsInImageAndRangeOnly) {
  const PinholeCamera camera = square_camera();
  EXPECT_TRUE(sees(camera, {0, 0, 1}));
  EXPECT_TRUE(sees(camera, {0.99, -0.99, 1}));
  EXPECT_FALSE(sees(camera, {1.01, 0, 1}));
  EXPECT_FALSE(sees(camera, {0, 0, -1}));
  EXPECT_FALSE(sees(camera, {0, 0, 0}));
  EXPECT_FALSE(sees(camera, {0, 0, 1}, {2, 3}));
  EXPECT_FALSE(sees(camera, {0, 0, 4}, {2, 3}));
  EXPECT_TRUE(sees(camera, {0, 0, 2.5}, {2, 3}));
}

TEST(Frustum, SeesBoxThatHoldsTheCamera) {
  EXPECT_TRUE(sees_box(square_camera(), AlignedBox3d(Vector3d(-5, -5, -5), Vector3d(5, 5, 5))));
}

TEST(Frustum, SeesBoxWhoseCornersAreAllOutOfView) {
  EXPECT_TRUE(sees_box(square_camera(), AlignedBox3d(Vector3d(-50, -0.1, 5), Vector3d(50, 0.1, 6))));
}

TEST(Frustum, DoesNotSeeBoxesBesideBehindOrPastTheRange) {
  const PinholeCamera camera = square_camera();
  EXPECT_FALSE(sees_box(camera, AlignedBox3d(Vector3d(2.1, -1, 1), Vector3d(4, 1, 2))));
  EXPECT_TRUE(sees_box(camera, AlignedBox3d(Vector3d(1.9, -1, 1), Vector3d(4, 1, 2))));
  EXPECT_FALSE(sees_box(camera, AlignedBox3d(Vector3d(-1, -1, -3), Vector3d(1, 1, -1))));
  EXPECT_FALSE(sees_box(camera, AlignedBox3d(Vector3d(-1, -1, 4), Vector3d(1, 1, 5)), {1, 3}));
  EXPECT_FALSE(sees_box(camera, AlignedBox3d(Vector3d(-1, -1, 4), Vector3d(1, 1, 5)), {6, 9}));
  EXPECT_FALSE(sees_box(camera, AlignedBox3d()));
}

/// How many points of a lattice in the box are seen.
int count_seen(const PinholeCamera& camera, const AlignedBox3d& box, const FrustumRange& range, int steps) {
  int seen = 0;
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j <= steps; ++j)
      for (int k = 0; k <= steps; ++k)
        seen += sees(camera, box.min() + box.sizes().cwiseProduct(Vector3d(i, j, k)) / steps, range);
  return seen;
}

TEST(Frustum, EdgeBesideEdgeIsSeparatedByNoFace) {
  // Turned down by 2 radians, the pyramid passes an edge of the box at a distance of 0.54, though no face of
  // either has the other wholly on its outer side.
  PinholeCamera camera = square_camera();
  camera.pose.rotation = Eigen::AngleAxisd(2, Vector3d::UnitX()).toRotationMatrix();
  const FrustumRange range{0.5, 6};
  AlignedBox3d box(Vector3d(2.75, -1.75, -5.25), Vector3d(4.25, 0.75, -0.75));
  EXPECT_FALSE(sees_box(camera, box, range));
  EXPECT_EQ(count_seen(camera, box, range, 40), 0);
  box.translate(Vector3d(-0.8, 0.9, 0));
  EXPECT_TRUE(sees_box(camera, box, range));
  EXPECT_GT(count_seen(camera, box, range, 40), 0);
}

double unit(unsigned x) { return (x % 100000) / 99999.0; }

RC_GTEST_PROP(Frustum, AgreesWithSamplingTheBox,
              (unsigned a, unsigned b, unsigned c, unsigned d, unsigned e)) {
  PinholeCamera camera = square_camera();
  camera.intrinsics = {120, 60, 70, 90, 40, 35, 3};
  camera.pose.rotation =
      Eigen::AngleAxisd(6 * unit(a), Vector3d(unit(b), 1 - unit(c), 0.3).normalized()).toRotationMatrix();
  camera.pose.centre = {unit(c), unit(d), unit(e)};
  // Somewhere about the frustum's surface, so that both answers are common.
  const Vector3d middle = camera.world_from_camera({4 * unit(e) - 2, 4 * unit(a ^ b) - 2, 4 * unit(c ^ d)});
  const Vector3d half(0.05 + unit(d) / 2, 0.05 + unit(e) / 2, 0.05 + unit(b) / 2);
  const AlignedBox3d box(middle - half, middle + half);
  const FrustumRange range{0.2, 3};
  const int seen = count_seen(camera, box, range, 12);
  RC_CLASSIFY(seen > 0);
  RC_CLASSIFY(sees_box(camera, box, range));
  // Sampling may miss a sliver, so only one direction holds for every box.
  if (seen > 0) RC_ASSERT(sees_box(camera, box, range));
}

}  // namespace
}  // namespace roxel

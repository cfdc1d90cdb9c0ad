#include "roxel/surface/manifold.h"

#include <gtest/gtest.h>

namespace roxel {
namespace {

/// A box's twelve triangles, outside counterclockwise; corner bits x, y, z.
Surface box_at(const Eigen::Vector3d& low) {
  Surface box;
  for (int corner = 0; corner < 8; ++corner)
    box.mesh.points.push_back(low + Eigen::Vector3d(corner & 1, corner >> 1 & 1, corner >> 2));
  for (const auto& [a, b, c, d] : std::vector<std::array<std::uint32_t, 4>>{
           {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    box.mesh.triangles.push_back({a, b, c});
    box.mesh.triangles.push_back({a, c, d});
  }
  return box;
}

/// Both, with points at one place made one.
Surface welded(const Surface& a, const Surface& b) {
  Surface both = a;
  std::vector<std::uint32_t> name;
  for (const Eigen::Vector3d& point : b.mesh.points) {
    const auto found = std::find(a.mesh.points.begin(), a.mesh.points.end(), point);
    name.push_back(static_cast<std::uint32_t>(found - a.mesh.points.begin()));
    if (found != a.mesh.points.end()) continue;
    name.back() = static_cast<std::uint32_t>(both.mesh.points.size());
    both.mesh.points.push_back(point);
  }
  for (const auto& [p, q, r] : b.mesh.triangles) both.mesh.triangles.push_back({name[p], name[q], name[r]});
  return both;
}

TEST(Manifold, WhatIsOneStaysAsItIs) {
  const Surface box = box_at({0, 0, 0});
  ASSERT_TRUE(is_manifold(box.mesh));
  const ManifoldSurface made = made_manifold(box);
  EXPECT_EQ(made.surface.mesh.triangles, box.mesh.triangles);
  EXPECT_EQ(made.surface.mesh.points, box.mesh.points);
  EXPECT_EQ(made.dropped, 0);
  EXPECT_EQ(made.cut, 0);
}

TEST(Manifold, SolidsThatTouchInAnEdgeAreCutApart) {
  Surface both = welded(box_at({0, 0, 0}), box_at({1, 1, 0}));
  both.normals.assign(both.mesh.points.size(), Eigen::Vector3f::UnitX());
  ASSERT_EQ(both.mesh.points.size(), 14u);
  ASSERT_FALSE(is_manifold(both.mesh));
  const ManifoldSurface made = made_manifold(both);
  EXPECT_TRUE(is_manifold(made.surface.mesh));
  EXPECT_EQ(made.dropped, 0);
  EXPECT_EQ(made.cut, 2);
  EXPECT_EQ(made.surface.normals.size(), 16u);
  EXPECT_EQ(connected_components(made.surface.mesh).count, 2u);
  // Each of the two is whole: as many points as a box has, and moved into itself.
  Eigen::AlignedBox3d first;
  for (std::size_t t = 0; t < 12; ++t)
    for (const std::uint32_t corner : made.surface.mesh.triangles[t])
      first.extend(made.surface.mesh.points[corner]);
  EXPECT_LE(first.max().x(), 1);
  EXPECT_NE(made.surface.mesh.points[7], Eigen::Vector3d(1, 1, 1));
  EXPECT_NEAR((made.surface.mesh.points[7] - Eigen::Vector3d(1, 1, 1)).norm(), 0, 0.01);
}

TEST(Manifold, SolidsThatTouchInAPointAreCutApart) {
  const Surface both = welded(box_at({0, 0, 0}), box_at({1, 1, 1}));
  ASSERT_EQ(both.mesh.points.size(), 15u);
  ASSERT_FALSE(is_manifold(both.mesh));
  const ManifoldSurface made = made_manifold(both);
  EXPECT_TRUE(is_manifold(made.surface.mesh));
  EXPECT_EQ(made.cut, 1);
  EXPECT_EQ(connected_components(made.surface.mesh).count, 2u);
}

TEST(Manifold, TrianglesThatAreThereTwiceGo) {
  Surface box = box_at({0, 0, 0});
  const auto [a, b, c] = box.mesh.triangles[3];
  box.mesh.triangles.push_back({b, c, a});  // the same again
  box.mesh.triangles.push_back({a, a, b});
  const ManifoldSurface again = made_manifold(box);
  EXPECT_EQ(again.dropped, 2);
  EXPECT_EQ(again.surface.mesh.triangles, box_at({0, 0, 0}).mesh.triangles);
  // A fin: two triangles back to back on an edge of the box.
  Surface finned = box_at({0, 0, 0});
  finned.mesh.points.emplace_back(2, 2, 2);
  finned.mesh.triangles.push_back({3, 7, 8});
  finned.mesh.triangles.push_back({7, 3, 8});
  const ManifoldSurface made = made_manifold(finned);
  EXPECT_EQ(made.dropped, 2);
  EXPECT_EQ(made.surface.mesh.triangles, box_at({0, 0, 0}).mesh.triangles);
  EXPECT_EQ(made.surface.mesh.points.size(), 8u);
}

TEST(Manifold, AThirdSheetOnAnEdgeIsCutOff) {
  Surface fan;
  fan.mesh.points = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 0.1, 0}, {0, -1, 0}};
  fan.mesh.triangles = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  const ManifoldSurface made = made_manifold(fan);
  EXPECT_TRUE(is_manifold(made.surface.mesh));
  EXPECT_EQ(made.surface.mesh.triangles.size(), 3u);
  EXPECT_EQ(made.cut, 2);
}

}  // namespace
}  // namespace roxel

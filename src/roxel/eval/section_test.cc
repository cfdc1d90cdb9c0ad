#include "roxel/eval/section.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace roxel {
namespace {

/// One voxel of width 0.5 at (1, 2, 3) in a brick whose corner is (10, 20, 30).
Volume one_voxel() {
  LatticeFrame frame;
  frame.origin = {10, 20, 30};
  frame.voxel_size = 0.5;
  frame.size_in_bricks = {1, 1, 2};
  Topology topology(frame);
  topology.insert({1, 2, 3});
  Volume volume({topology});
  volume.tau = {tau_from_alpha(0.5f)};
  return volume;
}

TEST(Section, ShowsAVoxelWhereItIs) {
  const Volume volume = one_voxel();
  struct Expected {
    int axis;
    double position;
    int width, height, x, y;
  };
  for (const Expected& e :
       {Expected{0, 10.7, 8, 16, 2, 12}, {1, 21.2, 8, 16, 1, 12}, {2, 31.8, 8, 8, 1, 5}}) {
    const Section section = opacity_section(volume, e.axis, e.position);
    EXPECT_EQ(section.opacity.width(), e.width);
    EXPECT_EQ(section.opacity.height(), e.height);
    float sum = 0;
    for (const float a : section.opacity.data()) sum += a;
    EXPECT_FLOAT_EQ(sum, 0.5f);
    EXPECT_FLOAT_EQ(*section.opacity.pixel(e.x, e.y), 0.5f) << "axis " << e.axis;
  }
}

TEST(Section, BesideTheVoxelOrTheBoxIsEmpty) {
  for (const double position : {31.4, 32.1, 29.0, 99.0}) {
    const Section section = opacity_section(one_voxel(), 2, position);
    for (const float a : section.opacity.data()) EXPECT_EQ(a, 0);
  }
}

TEST(Section, OutlineOfATriangle) {
  const Volume volume = one_voxel();
  const Section section = opacity_section(volume, 2, 31);
  const Mesh mesh{{{10, 20, 30}, {12, 20, 30}, {10, 20, 32}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                  {{0, 1, 2}, {3, 4, 5}}};
  const auto outline = surface_outline(mesh, section, volume.index(0).frame());
  ASSERT_EQ(outline.size(), 1);  // the other triangle is far below
  // From (11, 20) to (10, 20) in the world: 2 and 0 voxels from the left, the picture's lower edge.
  EXPECT_NEAR((outline[0][0] - Eigen::Vector2d(2, 8)).norm(), 0, 1e-12);
  EXPECT_NEAR((outline[0][1] - Eigen::Vector2d(0, 8)).norm(), 0, 1e-12);
}

}  // namespace
}  // namespace roxel

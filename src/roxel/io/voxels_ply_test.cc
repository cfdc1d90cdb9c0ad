#include "roxel/io/voxels_ply.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <string>

#include "roxel/base/temp_folder.h"

namespace roxel {
namespace {

TEST(VoxelsPly, HoldsTheOpaqueVoxelsOfTheBoxAsPoints) {
  const auto frames = nested_frames({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(32)}, 1, 1);
  Topology box(frames[0]), surround(frames[1]);
  for (int i : {1, 2, 3}) box.insert({i, 5, 20});
  surround.insert({0, 0, 0});
  Volume volume({box, surround});
  volume.tau = {tau_from_alpha(0.9f), tau_from_alpha(0.1f), tau_from_alpha(0.5f), 16};
  volume.confidence = {0.8f, 0.8f, 0.4f, 0.8f};
  volume.color_mean[0] = {1, 0, 2};         // brighter than white is clipped
  volume.color_mean[2] = {0.2140f, 0, -1};  // sRGB 0.5; below black is clipped
  const TempFolder folder;
  const auto path = folder / "voxels.ply";
  EXPECT_EQ(write_voxels_ply(path, volume, ColorTransform(ColorSpace::kRgb), 0.3f, 0.5f), 1);
  EXPECT_EQ(write_voxels_ply(path, volume, ColorTransform(ColorSpace::kRgb), 0.3f, 0.2f), 2);

  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  EXPECT_EQ(text.rfind("ply\nformat binary_little_endian 1.0\n", 0), 0u);
  EXPECT_NE(text.find("element vertex 2\n"), std::string::npos);
  const std::size_t body = text.find("end_header\n") + 11;
  ASSERT_EQ(text.size() - body, 2u * 19);
  float floats[4];
  std::uint8_t rgb[3];
  const auto row = [&](int r) {
    std::memcpy(floats, text.data() + body + 19 * r, 12);
    std::memcpy(rgb, text.data() + body + 19 * r + 12, 3);
    std::memcpy(floats + 3, text.data() + body + 19 * r + 15, 4);
  };
  row(0);
  EXPECT_EQ(floats[0], 1.5f);
  EXPECT_EQ(floats[1], 5.5f);
  EXPECT_EQ(floats[2], 20.5f);
  EXPECT_FLOAT_EQ(floats[3], 0.9f);
  EXPECT_EQ(rgb[0], 255);
  EXPECT_EQ(rgb[1], 0);
  EXPECT_EQ(rgb[2], 255);
  row(1);
  EXPECT_EQ(floats[0], 3.5f);
  EXPECT_NEAR(rgb[0], 127.5, 0.6);
  EXPECT_EQ(rgb[2], 0);
}

TEST(VoxelsPly, AnEmptyVolumeIsAnEmptyCloud) {
  const TempFolder folder;
  const auto path = folder / "voxels.ply";
  EXPECT_EQ(write_voxels_ply(path, Volume(), ColorTransform(), 0.5f, 0), 0);
  EXPECT_TRUE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace roxel

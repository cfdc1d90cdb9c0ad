#include "roxel/io/colmap_dense.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "roxel/base/error.h"
#include "roxel/base/temp_folder.h"
#include "roxel/io/dataset_reader.h"
#include "roxel/io/image_file.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

class ColmapDense : public ::testing::Test {
 protected:
  const TempFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

Image ramp(int width, int height, int channels) {
  Image image(width, height, channels);
  for (std::size_t i = 0; i < image.data().size(); ++i) image.data()[i] = 0.25f * static_cast<float>(i) - 3;
  return image;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST_F(ColmapDense, MapsComeBackAsTheyWere) {
  for (const int channels : {1, 3}) {
    const Image map = ramp(5, 4, channels);
    write_colmap_map(folder_ / "deep" / "map.bin", map);
    const Image back = read_colmap_map(folder_ / "deep" / "map.bin");
    EXPECT_EQ(back.width(), 5);
    EXPECT_EQ(back.height(), 4);
    EXPECT_EQ(back.channels(), channels);
    EXPECT_EQ(back.data(), map.data());
  }
}

TEST_F(ColmapDense, AMapIsATextualSizeThenPlanesOfRows) {
  Image map(2, 1, 3);
  map.data() = {1, 2, 3, 4, 5, 6};  // two pixels
  write_colmap_map(folder_ / "map.bin", map);
  const float planes[6] = {1, 4, 2, 5, 3, 6};
  EXPECT_EQ(bytes_of(folder_ / "map.bin"),
            "2&1&3&" + std::string(reinterpret_cast<const char*>(planes), sizeof planes));
}

TEST_F(ColmapDense, BrokenMapsAreNamed) {
  const fs::path file = folder_ / "map.bin";
  EXPECT_THROW(read_colmap_map(file), InvalidInput);
  for (const std::string& text :
       {std::string(), std::string("2&2&"), std::string("2x2x1xabcd"), std::string("2&2&1&abc"),
        std::string("-2&2&1&"), std::string("1&1&1&abcde"), std::string("99999999&99999999&3&")}) {
    std::ofstream(file, std::ios::binary) << text;
    try {
      read_colmap_map(file);
      FAIL() << text;
    } catch (const InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find("map.bin"), std::string::npos);
    }
  }
}

TEST_F(ColmapDense, TheSparseModelNamesCamerasAndWhoSharesPoints) {
  Dataset dataset;
  for (int v = 0; v < 2; ++v) {
    View view;
    view.name = "view" + std::to_string(v);
    view.image_path = fs::absolute(folder_ / "images" / (view.name + ".png")).string();
    view.camera.intrinsics = {8, 6, 20, 21, 4, 3, 0};
    view.camera.pose.centre = {0.5 * v, 0, -2};
    view.lens.intrinsics = view.camera.intrinsics;
    dataset.views.push_back(view);
    write_png(view.image_path, Image(8, 6, 3, 0.5f));
  }
  const TrackedPoint point{{0, 0, 1}, {{0, {4, 3}}, {1, {0.7, 3}}}};
  write_colmap_workspace(dataset, {point}, folder_);
  EXPECT_EQ(colmap_map_path(folder_, "depth", dataset.views[1]),
            folder_ / "stereo" / "depth_maps" / "view1.png.geometric.bin");
  EXPECT_EQ(bytes_of(folder_ / "stereo" / "fusion.cfg"), "view0.png\nview1.png\n");
  EXPECT_NE(bytes_of(folder_ / "sparse" / "points3D.txt").find("1 0 0 1 128 128 128 0 1 0 2 0\n"),
            std::string::npos);
  EXPECT_NE(bytes_of(folder_ / "sparse" / "images.txt").find("\n4 3 1 \n"), std::string::npos);
  const Dataset back = read_dataset(folder_.string());
  ASSERT_EQ(back.views.size(), 2u);
  EXPECT_EQ(back.format, "colmap");
  EXPECT_LT((back.views[1].camera.pose.centre - dataset.views[1].camera.pose.centre).norm(), 1e-12);
  EXPECT_EQ(back.views[0].camera.intrinsics, dataset.views[0].camera.intrinsics);
  dataset.views[0].camera.intrinsics.skew = 0.1;
  EXPECT_THROW(write_colmap_workspace(dataset, {}, folder_), InvalidInput);
}

}  // namespace
}  // namespace roxel

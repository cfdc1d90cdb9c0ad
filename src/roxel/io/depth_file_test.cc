#include "roxel/io/depth_file.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "roxel/base/error.h"
#include "roxel/base/temp_folder.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class DepthFileTest : public testing::Test {
 protected:
  static std::string refusal(const fs::path& path) {
    try {
      read_depth(path);
      return "";
    } catch (const InvalidInput& e) {
      return e.what();
    }
  }

  const TempFolder temporary_;
  const fs::path run_ = temporary_.path();
};

Image noise(int width, int height, unsigned seed) {
  Image image(width, height, 1);
  std::mt19937 random(seed);
  for (float& x : image.data()) x = 1e-3f * (random() % 100000000);
  return image;
}

TEST_F(DepthFileTest, ComesBackBitForBit) {
  const DepthLayers layers{noise(37, 23, 1), noise(37, 23, 2), noise(37, 23, 3), noise(37, 23, 4),
                           noise(37, 23, 5)};
  const fs::path path = depth_path(run_, "left/0001");
  write_depth(path, layers);
  const DepthLayers back = read_depth(path);
  EXPECT_EQ(back.depth.width(), 37);
  EXPECT_EQ(back.depth.data(), layers.depth.data());
  EXPECT_EQ(back.variance.data(), layers.variance.data());
  EXPECT_EQ(back.opacity.data(), layers.opacity.data());
  EXPECT_EQ(back.depth_bp.data(), layers.depth_bp.data());
  EXPECT_EQ(back.variance_bp.data(), layers.variance_bp.data());
}

TEST_F(DepthFileTest, HoldsFloatChannelsByName) {
  write_depth(depth_path(run_, "a"), {noise(4, 3, 1), noise(4, 3, 2), noise(4, 3, 3)});
  const auto file = OIIO::ImageInput::open((run_ / "depth/a.exr").string());
  ASSERT_TRUE(file);
  EXPECT_THAT(file->spec().channelnames, testing::UnorderedElementsAre("Z", "V", "A"));
  EXPECT_EQ(file->spec().format, OIIO::TypeFloat);
  EXPECT_TRUE(read_depth(run_ / "depth/a.exr").depth_bp.empty());
}

TEST(DepthPath, KeepsFoldersAndDotsOfTheNameAndStaysInTheRun) {
  EXPECT_EQ(depth_path("run", "left/frame.0001"), fs::path("run/depth/left/frame.0001.exr"));
  EXPECT_EQ(depth_path("run", "./train/r_0"), fs::path("run/depth/train/r_0.exr"));
  EXPECT_EQ(depth_path("run", "../../etc/x"), fs::path("run/depth/etc/x.exr"));
  EXPECT_EQ(depth_path("run", "/abs/x"), fs::path("run/depth/abs/x.exr"));
}

TEST_F(DepthFileTest, RefusesWhatIsNoDepthFile) {
  EXPECT_THAT(refusal(run_ / "missing.exr"),
              testing::AllOf(HasSubstr("missing.exr"), HasSubstr("no such file")));
  fs::create_directories(run_);
  std::ofstream(run_ / "empty.exr") << "";
  EXPECT_THAT(refusal(run_ / "empty.exr"), testing::AllOf(HasSubstr("empty.exr"), HasSubstr("0 bytes")));
  const auto file = OIIO::ImageOutput::create("a.exr");
  file->open((run_ / "rgb.exr").string(), OIIO::ImageSpec(2, 2, 3, OIIO::TypeFloat));
  file->write_image(OIIO::TypeFloat, std::vector<float>(12).data());
  file->close();
  EXPECT_THAT(refusal(run_ / "rgb.exr"), HasSubstr("found no channel Z"));
}

TEST_F(DepthFileTest, RefusesAFileThatEndsEarly) {
  write_depth(run_ / "whole.exr", {noise(64, 64, 1), noise(64, 64, 2), noise(64, 64, 3)});
  std::ifstream in(run_ / "whole.exr", std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  for (double share : {0.01, 0.3, 0.9}) {
    std::ofstream(run_ / "cut.exr", std::ios::binary).write(whole.data(), share * whole.size());
    EXPECT_THAT(refusal(run_ / "cut.exr"), HasSubstr("cut.exr")) << share;
  }
}

TEST_F(DepthFileTest, LayersMustBeOfOneSize) {
  EXPECT_THROW(write_depth(run_ / "x.exr", {noise(4, 4, 1), noise(4, 3, 2), noise(4, 4, 3)}),
               std::logic_error);
  EXPECT_FALSE(fs::exists(run_ / "x.exr"));
}

}  // namespace
}  // namespace roxel

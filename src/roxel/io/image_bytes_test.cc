#include "roxel/io/image_bytes.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "roxel/base/temp_folder.h"
#include "roxel/io/image_file.h"

namespace roxel {
namespace {

Image ramp(int channels) {
  Image image(40, 30, channels);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x)
      for (int c = 0; c < channels; ++c) image.pixel(x, y)[c] = static_cast<float>(x + c) / 42;
  return image;
}

Image read_back(const std::string& bytes, const std::string& name) {
  const TempFolder folder;
  const std::string path = (folder / name).string();
  std::ofstream(path, std::ios::binary) << bytes;
  return read_image(path, Response{ResponseCurve::kLinear}).rgb;
}

TEST(ImageBytes, PngIsExactToAByte) {
  const Image image = ramp(3), back = read_back(png_bytes(image), "image_bytes.png");
  ASSERT_EQ(back.width(), 40);
  for (std::size_t i = 0; i < image.data().size(); ++i)
    ASSERT_NEAR(back.data()[i], image.data()[i], 0.51 / 255);
  EXPECT_EQ(read_back(png_bytes(ramp(1)), "image_bytes_grey.png").height(), 30);
}

TEST(ImageBytes, JpegIsNearAndSmallerAtLowerQuality) {
  const Image image = ramp(3), back = read_back(jpeg_bytes(image, 90), "image_bytes.jpg");
  for (std::size_t i = 0; i < image.data().size(); ++i) ASSERT_NEAR(back.data()[i], image.data()[i], 0.05);
  EXPECT_LT(jpeg_bytes(image, 20).size(), jpeg_bytes(image, 95).size());
  EXPECT_EQ(jpeg_bytes(image), jpeg_bytes(image));
}

}  // namespace
}  // namespace roxel

#include "roxel/io/photograph.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <thread>
#include <vector>

#include "roxel/base/error.h"
#include "roxel/base/temp_folder.h"
#include "roxel/base/test_data.h"
#include "roxel/image/undistort.h"
#include "roxel/io/image_file.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr int kWidth = 80, kHeight = 60, kMaskEdge = 60;

/// Red tells the column, green the row, of a file of 80 x 60 pixels.
Image position_image() {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      image.pixel(x, y)[0] = (x + 0.5f) / 100;
      image.pixel(x, y)[1] = (y + 0.5f) / 100;
    }
  return image;
}

class LoadPhotograph : public ::testing::Test {
 protected:
  LoadPhotograph() {
    view_.name = "a";
    view_.image_path = path("a.png");
    view_.source = "images.txt:5";
    view_.lens.intrinsics = {kWidth, kHeight, 60, 60, 40, 30, 0};
    view_.camera.intrinsics = view_.lens.intrinsics;
    write_png(view_.image_path, position_image(), Response{ResponseCurve::kLinear});
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void bend(double k1) {
    view_.lens.model = LensModel::kSimpleRadial;
    view_.lens.coefficients[0] = k1;
  }
  /// Background to the left of column 60, object from there on.
  void add_mask() {
    Mask mask(kWidth, kHeight, 0);
    for (int y = 0; y < kHeight; ++y)
      for (int x = kMaskEdge; x < kWidth; ++x) mask.at(x, y) = 255;
    view_.mask_path = path("mask.png");
    write_png(view_.mask_path, mask);
  }
  Photograph load(MaskUse masks = MaskUse::kAuto) const {
    return make_photograph_loader({Response{ResponseCurve::kLinear}, masks})(view_);
  }

  const TempFolder folder_;
  View view_;
};

TEST_F(LoadPhotograph, WithoutDistortionGivesTheFilesPixels) {
  const Photograph photograph = load();
  EXPECT_EQ(photograph.rgb.data(), read_image(view_.image_path, Response{ResponseCurve::kLinear}).rgb.data());
  EXPECT_TRUE(photograph.valid.empty());
  EXPECT_TRUE(photograph.foreground.empty());
}

TEST_F(LoadPhotograph, DecodesByFileTypeUnlessTold) {
  const Image by_type = make_photograph_loader()(view_).rgb;
  EXPECT_EQ(by_type.data(), read_image(view_.image_path).rgb.data());
  EXPECT_NE(by_type.data(), load().rgb.data());
}

TEST_F(LoadPhotograph, UndoesTheLensOfImageAndMaskAlike) {
  bend(0.3);
  add_mask();
  const Photograph photograph = load();
  ASSERT_FALSE(photograph.valid.empty());
  EXPECT_EQ(photograph.valid.at(0, 0), 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      if (!photograph.valid.at(x, y)) continue;
      const Eigen::Vector2d n = normalised_from_pixel(view_.camera.intrinsics, {x + 0.5, y + 0.5});
      const Eigen::Vector2d p = pixel_from_normalised(view_.lens.intrinsics, distort(view_.lens, n));
      if ((p.array() < 1).any() || p.x() > kWidth - 1 || p.y() > kHeight - 1) continue;
      // The file has 8 bits: half a code is 0.2 of the 0.01 that one pixel is.
      ASSERT_NEAR(photograph.rgb.pixel(x, y)[0] * 100, p.x(), 0.21);
      ASSERT_NEAR(photograph.rgb.pixel(x, y)[1] * 100, p.y(), 0.21);
      if (std::abs(p.x() - kMaskEdge) > 0.5) {
        ASSERT_EQ(photograph.foreground.at(x, y), p.x() > kMaskEdge ? 255 : 0);
      }
    }
}

TEST_F(LoadPhotograph, MaskFilesComeBeforeAlphaAndCanBeIgnored) {
  OIIO::ImageSpec spec(kWidth, kHeight, 4, OIIO::TypeUInt8);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  std::vector<unsigned char> pixels(kWidth * kHeight * 4, 200);
  const auto out = OIIO::ImageOutput::create(view_.image_path);
  ASSERT_TRUE(out->open(view_.image_path, spec) && out->write_image(OIIO::TypeUInt8, pixels.data()) &&
              out->close());
  EXPECT_EQ(load().foreground.at(3, 3), 200);
  EXPECT_TRUE(load(MaskUse::kNone).foreground.empty());
  add_mask();
  EXPECT_EQ(load().foreground.at(3, 3), 0);
  EXPECT_TRUE(load(MaskUse::kNone).foreground.empty());
}

TEST_F(LoadPhotograph, OpaqueAlphaIsNoMask) {
  OIIO::ImageSpec spec(kWidth, kHeight, 4, OIIO::TypeUInt8);
  std::vector<unsigned char> pixels(kWidth * kHeight * 4, 255);
  const auto out = OIIO::ImageOutput::create(view_.image_path);
  ASSERT_TRUE(out->open(view_.image_path, spec) && out->write_image(OIIO::TypeUInt8, pixels.data()) &&
              out->close());
  EXPECT_TRUE(load().foreground.empty());
}

TEST_F(LoadPhotograph, PixelsThatAreNotFiniteAreInvalid) {
  std::vector<FloatChannel> channels;
  for (const char* name : {"R", "G", "B"}) channels.push_back({name, Image(kWidth, kHeight, 1, 0.5f)});
  channels[1].plane.pixel(7, 9)[0] = std::nanf("");
  view_.image_path = path("a.exr");
  write_exr(view_.image_path, channels);
  const Photograph photograph = load();
  ASSERT_FALSE(photograph.valid.empty());
  EXPECT_EQ(photograph.valid.at(7, 9), 0);
  EXPECT_EQ(photograph.valid.at(8, 9), 255);
  bend(-0.1);
  const Photograph straight = load();
  for (const float value : straight.rgb.data()) ASSERT_TRUE(std::isfinite(value));
}

TEST_F(LoadPhotograph, SizesMustAgreeWithTheCamera) {
  view_.lens.intrinsics.width = 81;
  EXPECT_THAT([&] { load(); },
              ThrowsMessage<InvalidInput>(AllOf(HasSubstr(view_.image_path), HasSubstr("images.txt:5"),
                                                HasSubstr("80 x 60"), HasSubstr("81 x 60"))));
  view_.lens.intrinsics.width = 80;
  view_.mask_path = path("mask.png");
  write_png(view_.mask_path, Mask(40, 30));
  EXPECT_THAT([&] { load(); },
              ThrowsMessage<InvalidInput>(AllOf(HasSubstr("a mask of 40 x 30"), HasSubstr("images.txt:5"),
                                                HasSubstr("80 x 60"), HasSubstr(view_.mask_path))));
  EXPECT_NO_THROW(load(MaskUse::kNone));
}

TEST_F(LoadPhotograph, MissingFilesNameTheirSource) {
  view_.mask_path = path("none.png");
  EXPECT_THAT([&] { load(); },
              ThrowsMessage<InvalidInput>(AllOf(HasSubstr("none.png"), HasSubstr("images.txt:5"))));
  view_.image_path = path("gone.png");
  EXPECT_THAT([&] { load(); },
              ThrowsMessage<InvalidInput>(AllOf(HasSubstr("gone.png"), HasSubstr("images.txt:5"))));
}

TEST_F(LoadPhotograph, LensThatLeavesNothingIsRefused) {
  bend(-0.1);
  view_.lens.intrinsics.cx = 1e6;
  EXPECT_THAT([&] { load(); }, ThrowsMessage<InvalidInput>(HasSubstr("no valid pixel")));
}

TEST_F(LoadPhotograph, OneLoaderServesManyThreadsAndLenses) {
  bend(-0.1);
  View other = view_;
  other.lens.coefficients[0] = -0.2;
  const auto loader = make_photograph_loader();
  const auto expected = loader(view_).rgb.data(), expected_other = loader(other).rgb.data();
  ASSERT_NE(expected, expected_other);
  std::atomic<int> good = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      for (int k = 0; k < 10; ++k)
        good +=
            (i + k) % 2 ? loader(view_).rgb.data() == expected : loader(other).rgb.data() == expected_other;
    });
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(good, 40);
}

TEST_F(LoadPhotograph, StatueOfLibertyIsStraightenedWithItsMask) {
  ROXEL_TEST_DATA_OR_SKIP(folder, "statue-of-liberty");
  view_.image_path = (folder / "images/1359873828_f015f87b16_o.jpg").string();
  view_.mask_path = (folder / "masks/1359873828_f015f87b16_o.png").string();
  view_.lens.intrinsics = {400, 600, 1237.15, 1237.15, 200, 300, 0};
  bend(-0.5517);
  view_.camera = undistorted_camera(view_.lens, {});
  const Photograph photograph = make_photograph_loader()(view_);
  EXPECT_EQ(photograph.rgb.width(), 400);
  EXPECT_TRUE(photograph.valid.empty());  // barrel distortion: the pinhole's image lies inside the file's
  ASSERT_EQ(photograph.foreground.height(), 600);
  const auto& mask = photograph.foreground.data();
  const auto object = std::count(mask.begin(), mask.end(), 255);
  EXPECT_GT(object, 400 * 600 / 20);
  EXPECT_LT(object, 400 * 600 * 19 / 20);
}

TEST_F(LoadPhotograph, DtuComesUnchangedWithItsMask) {
  ROXEL_TEST_DATA_OR_SKIP(folder, "dtu-scan24");
  const auto first = [](const fs::path& of) {
    std::vector<fs::path> paths(fs::directory_iterator(of), {});
    return std::min_element(paths.begin(), paths.end())->string();
  };
  view_.image_path = first(folder / "images");
  view_.mask_path = first(folder / "masks");
  view_.lens.intrinsics = view_.camera.intrinsics = {800, 600, 1400, 1400, 400, 300, 0};
  const Photograph photograph = make_photograph_loader()(view_);
  EXPECT_TRUE(photograph.valid.empty());
  EXPECT_EQ(photograph.rgb.data(), read_image(view_.image_path).rgb.data());
  EXPECT_EQ(photograph.foreground.data(), read_mask(view_.mask_path).data());
}

}  // namespace
}  // namespace roxel

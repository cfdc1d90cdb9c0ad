#include "roxel/image/undistort.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <ostream>
#include <string>

#include "roxel/camera/frustum.h"

namespace roxel {
namespace {

using Eigen::Vector2d;

const Intrinsics kFile{320, 240, 260, 250, 150, 130, 2.5};

Lens lens(LensModel model, std::array<double, 8> coefficients) { return {model, kFile, coefficients}; }

/// A smooth scene on the plane z = 1, about 60 pixels to a wave: interpolating it linearly is off by at most
/// 0.2 (2 pi / 60)^2 / 8 per axis, which looks like a shift of 0.05 pixels where the gradient is 0.012.
double pattern(const Vector2d& normalised, int channel) {
  const double phase = 2 * std::numbers::pi * 5 / 1.2;
  return 0.5 + 0.2 * std::sin(phase * normalised.x() + channel) +
         0.2 * std::cos(phase * normalised.y() - channel);
}

/// What the lens's camera photographs: each pixel of the file looks back through the lens.
Image photograph(const Lens& l) {
  Image image(l.intrinsics.width, l.intrinsics.height, 3);
  const double radius = valid_radius(l);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const auto from = undistort_point(l, normalised_from_pixel(l.intrinsics, {x + 0.5, y + 0.5}), radius);
      for (int c = 0; c < 3 && from; ++c) image.pixel(x, y)[c] = static_cast<float>(pattern(*from, c));
    }
  return image;
}

/// Largest shift that explains the differences to the true pinhole image: |difference| / |gradient|, where
/// the gradient (per pixel) is strong, over valid pixels whose sources are inside the photograph by a pixel.
double largest_shift_px(const Image& image, const Mask& valid, const Intrinsics& k) {
  double largest = 0;
  int compared = 0;
  for (int y = 2; y < image.height() - 2; ++y)
    for (int x = 2; x < image.width() - 2; ++x) {
      bool inside = true;
      for (int d = -2; d <= 2; ++d)
        inside = inside && (valid.empty() || (valid.at(x + d, y) && valid.at(x, y + d)));
      if (!inside) continue;
      const auto truth = [&](double dx, double dy) {
        return pattern(normalised_from_pixel(k, {x + 0.5 + dx, y + 0.5 + dy}), 0);
      };
      const double gradient = std::hypot(truth(0.5, 0) - truth(-0.5, 0), truth(0, 0.5) - truth(0, -0.5));
      if (gradient < 0.012) continue;
      largest = std::max(largest, std::abs(image.pixel(x, y)[0] - truth(0, 0)) / gradient);
      ++compared;
    }
  EXPECT_GT(compared, 5000);
  return largest;
}

struct Case {
  const char* name;
  Lens lens;

  friend void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
};

class Undistort : public ::testing::TestWithParam<Case> {};

TEST_P(Undistort, GivesWhatThePinholeWouldHaveSeen) {
  const Lens& l = GetParam().lens;
  const PinholeCamera camera = undistorted_camera(l, {});
  Mask valid;
  const Image image = undistort(photograph(l), l, camera.intrinsics, valid);
  ASSERT_EQ(image.width(), kFile.width);
  ASSERT_EQ(image.height(), kFile.height);
  EXPECT_LT(largest_shift_px(image, valid, camera.intrinsics), 0.1);
}

INSTANTIATE_TEST_SUITE_P(
    Models, Undistort,
    ::testing::Values(Case{"SimpleRadialIn", lens(LensModel::kSimpleRadial, {-0.2})},
                      Case{"SimpleRadialOut", lens(LensModel::kSimpleRadial, {0.2})},
                      Case{"Radial", lens(LensModel::kRadial, {-0.2, 0.1})},
                      Case{"OpenCv", lens(LensModel::kOpenCv, {-0.2, 0.05, 0.01, -0.02})},
                      Case{"FullOpenCv",
                           lens(LensModel::kFullOpenCv, {0.5, -0.1, 0.001, 0.002, 0.02, 0.7, 0.1, 0})},
                      Case{"SimpleRadialFisheye", lens(LensModel::kSimpleRadialFisheye, {0.02})},
                      Case{"RadialFisheye", lens(LensModel::kRadialFisheye, {0.02, -0.01})},
                      Case{"OpenCvFisheye", lens(LensModel::kOpenCvFisheye, {-0.01, 0.01, -0.005, 0.001})},
                      Case{"ThinPrismFisheye",
                           lens(LensModel::kThinPrismFisheye, {0.01, 0, 0.002, -0.003, 0, 0, 0.004, 0.002})},
                      Case{"Fov", lens(LensModel::kFov, {0.8})}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(UndistortMap, WithoutDistortionCopiesBitForBit) {
  const Lens l = lens(LensModel::kOpenCv, {});
  Image source(kFile.width, kFile.height, 3);
  for (std::size_t i = 0; i < source.data().size(); ++i) source.data()[i] = 1.0f / (i + 3);
  source.data()[7] = std::nanf("");
  Mask valid(1, 1);
  const Image image = undistort(source, l, undistorted_camera(l, {}).intrinsics, valid);
  EXPECT_EQ(std::memcmp(image.data().data(), source.data().data(), source.data().size() * sizeof(float)), 0);
  EXPECT_TRUE(valid.empty());
  EXPECT_TRUE(UndistortMap(l, kFile).identity());
}

TEST(UndistortMap, OtherIntrinsicsAloneResample) {
  // Half the focal length about the same principal point: pixel (u, v) comes from c + 2 (u - c).
  const Lens l{LensModel::kPinhole, {40, 40, 50, 50, 20, 20, 0}, {}};
  Intrinsics half = l.intrinsics;
  half.fx = half.fy = 25;
  Image source(40, 40, 1);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x) source.pixel(x, y)[0] = x + 0.5f;
  Mask valid;
  const Image image = undistort(source, l, half, valid);
  EXPECT_NEAR(image.pixel(24, 20)[0], 20 + 2 * (24.5 - 20), 1e-4);
  EXPECT_EQ(valid.at(24, 20), 255);
  EXPECT_EQ(valid.at(2, 20), 0);
}

TEST(UndistortMap, MarksWhatLiesOutsideTheFile) {
  // Pincushion: the pinhole's corners look past the photograph.
  const Lens l = lens(LensModel::kSimpleRadial, {0.2});
  const UndistortMap map(l, kFile);
  const Mask valid = map.valid();
  ASSERT_FALSE(valid.empty());
  for (int y = 0; y < kFile.height; ++y)
    for (int x = 0; x < kFile.width; ++x) {
      const Vector2d n = normalised_from_pixel(kFile, {x + 0.5, y + 0.5});
      const Vector2d p = pixel_from_normalised(kFile, distort(l, n));
      const bool inside = p.x() >= 0 && p.x() <= kFile.width && p.y() >= 0 && p.y() <= kFile.height;
      ASSERT_EQ(valid.at(x, y), inside ? 255 : 0) << x << ", " << y;
    }
  const Image image = map.apply(Image(kFile.width, kFile.height, 3, 1.0f));
  EXPECT_EQ(image.pixel(0, 0)[0], 0.0f);
  EXPECT_EQ(image.pixel(160, 120)[2], 1.0f);
}

TEST(UndistortMap, BarrelFillsTheImage) {
  EXPECT_TRUE(UndistortMap(lens(LensModel::kSimpleRadial, {-0.2}), kFile).valid().empty());
}

TEST(UndistortMap, NothingComesFromPastTheFold) {
  // k1 = -1.2 folds at r = 0.527; the corners of this image are at 0.77, and would map back inside the file.
  const Lens l = lens(LensModel::kSimpleRadial, {-1.2});
  const Mask valid = UndistortMap(l, kFile).valid();
  ASSERT_FALSE(valid.empty());
  const double fold = std::sqrt(1 / 3.6);
  int past = 0;
  for (int y = 0; y < kFile.height; ++y)
    for (int x = 0; x < kFile.width; ++x) {
      const bool inside = normalised_from_pixel(kFile, {x + 0.5, y + 0.5}).norm() < fold;
      ASSERT_EQ(valid.at(x, y), inside ? 255 : 0) << x << ", " << y;
      past += !inside;
    }
  EXPECT_GT(past, 1000);
}

TEST(UndistortMap, InvalidSourcePixelsSpoilOnlyTheirNeighbours) {
  const Lens l = lens(LensModel::kSimpleRadial, {-0.2});
  const UndistortMap map(l, kFile);
  Mask source(kFile.width, kFile.height, 255);
  source.at(200, 100) = 0;
  const Mask valid = map.valid(source);
  ASSERT_FALSE(valid.empty());
  int spoilt = 0;
  for (int y = 0; y < kFile.height; ++y)
    for (int x = 0; x < kFile.width; ++x) {
      if (valid.at(x, y)) continue;
      ++spoilt;
      const Vector2d n = normalised_from_pixel(kFile, {x + 0.5, y + 0.5});
      EXPECT_LT((pixel_from_normalised(kFile, distort(l, n)) - Vector2d(200.5, 100.5)).cwiseAbs().maxCoeff(),
                1);
    }
  EXPECT_GE(spoilt, 4);
  EXPECT_LE(spoilt, 9);
}

TEST(UndistortMap, MasksMoveWithTheirImage) {
  const Lens l = lens(LensModel::kOpenCv, {-0.2, 0.05, 0.01, -0.02});
  Image image(kFile.width, kFile.height, 1);
  Mask mask(kFile.width, kFile.height, 0);
  for (int y = 0; y < kFile.height; ++y)
    for (int x = 0; x < kFile.width; ++x) {
      mask.at(x, y) = static_cast<std::uint8_t>((x * 3 + y * 5) % 256);
      image.pixel(x, y)[0] = mask.at(x, y);
    }
  const UndistortMap map(l, kFile);
  const Image moved_image = map.apply(image);
  const Mask moved = map.apply(mask);
  for (int y = 0; y < kFile.height; ++y)
    for (int x = 0; x < kFile.width; ++x) ASSERT_EQ(moved.at(x, y), std::lround(moved_image.pixel(x, y)[0]));
}

TEST(UndistortMap, SizesMustAgree) {
  const UndistortMap map(lens(LensModel::kSimpleRadial, {-0.2}), kFile);
  EXPECT_THROW(map.apply(Image(10, 10, 3)), std::logic_error);
  EXPECT_THROW(map.apply(Mask(10, 10)), std::logic_error);
}

TEST(UndistortedCamera, KeepsTheFilesIntrinsicsAndThePose) {
  Pose pose;
  pose.centre = {1, 2, 3};
  for (const Lens& l :
       {lens(LensModel::kOpenCv, {-0.2, 0, 0, 0.01}), lens(LensModel::kOpenCvFisheye, {0.01})}) {
    const PinholeCamera camera = undistorted_camera(l, pose);
    EXPECT_EQ(camera.intrinsics, l.intrinsics);
    EXPECT_EQ(camera.pose.centre, pose.centre);
  }
}

TEST(UndistortedCamera, NeverLooksPast85Degrees) {
  Lens l{LensModel::kOpenCvFisheye, {2000, 1500, 50, 60, 990, 760, 1}, {}};
  const PinholeCamera camera = undistorted_camera(l, {});
  double widest = 0;
  for (const auto& corner : frustum_corners(camera, {1, 2}))
    widest = std::max(widest, std::atan(corner.head<2>().norm() / corner.z()));
  EXPECT_NEAR(widest * 180 / std::numbers::pi, 85, 1e-6);
  EXPECT_NEAR(camera.intrinsics.fx / camera.intrinsics.fy, 50.0 / 60, 1e-12);
}

}  // namespace
}  // namespace roxel

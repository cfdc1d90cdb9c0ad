#include "roxel/solve/background_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using ::testing::HasSubstr;

Photograph photo_of(const std::array<float, 3>& border, const std::array<float, 3>& middle, bool mask) {
  Photograph photo;
  photo.rgb = Image(64, 48, 3);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const bool inside = x > 8 && x < 56 && y > 8 && y < 40;
      std::copy_n((inside ? middle : border).data(), 3, photo.rgb.pixel(x, y));
    }
  if (mask) photo.foreground = Mask(64, 48, 255);
  return photo;
}

Photograph textured_photo(unsigned seed) {
  Photograph photo = photo_of({0, 0, 0}, {0, 0, 0}, false);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(0, 1);
  for (float& value : photo.rgb.data()) value = unit(random);
  return photo;
}

Scene luv_scene() {
  Scene scene;
  scene.transform = ColorTransform(ColorSpace::kLuv);
  scene.background.unknown_likelihood = 0.0007f;
  return scene;
}

Scene chosen(const std::vector<Photograph>& photos, const ReconstructOptions& options,
             const Daylight* daylight = nullptr) {
  Scene scene = luv_scene();
  std::vector<BorderSample> borders;
  for (const Photograph& photo : photos) borders.push_back(sample_border(photo));
  choose_background(borders, options, daylight, scene);
  return scene;
}

ReconstructOptions with(BackgroundChoice choice) {
  ReconstructOptions options;
  options.background = choice;
  return options;
}

std::array<float, 3> luv(const std::array<float, 3>& rgb) {
  std::array<float, 3> out;
  luv_scene().transform.from_rgb(rgb.data(), out.data());
  return out;
}

TEST(BackgroundChoice, MasksOfAllImagesAreTheBackground) {
  const Scene scene =
      chosen({photo_of({0, 0, 0}, {1, 0, 0}, true), photo_of({0, 0, 0}, {1, 0, 0}, true)}, {});
  EXPECT_EQ(scene.background.kind, BackgroundKind::kMask);
  EXPECT_THAT(scene.notes, ::testing::Contains(HasSubstr("every image has")));
}

TEST(BackgroundChoice, OneImageWithoutMaskIsEnoughToIgnoreMasks) {
  const Scene scene =
      chosen({photo_of({0, 0, 0}, {1, 0, 0}, true), photo_of({0, 0, 0}, {1, 0, 0}, false)}, {});
  EXPECT_EQ(scene.background.kind, BackgroundKind::kKnown);
}

TEST(BackgroundChoice, MasksOfTheSkyCountWhereThereAreSomeAndTheOthersAreOpen) {
  const std::vector<Photograph> photos{photo_of({0, 0, 0}, {1, 0, 0}, true),
                                       photo_of({0, 0, 0}, {1, 0, 0}, false)};
  NodeSky sky, night;
  sky.model = SkyModel::kPerez;
  sky.sun_source = SunSource::kTime;
  night.name = "n07";
  night.fallback = "night";
  const Daylight daylight{{sky, night}, {0, 1}, {1, 0}}, dark{{night}, {0, 0}, {0, 0}};
  for (const BackgroundChoice choice : {BackgroundChoice::kAuto, BackgroundChoice::kSky}) {
    const Scene scene = chosen(photos, with(choice), &daylight);
    EXPECT_EQ(scene.background.kind, BackgroundKind::kMask);
    EXPECT_EQ(scene.masked, (std::vector<std::uint8_t>{1, 0}));
    EXPECT_TRUE(scene.has_open_ends());
    EXPECT_THAT(scene.notes, ::testing::Contains(HasSubstr("unknown for the 1 of 2 images")));
    EXPECT_FALSE(chosen({photos[0], photos[0]}, with(choice), &daylight).has_open_ends());
  }
  for (const Daylight* missing : {&dark, static_cast<const Daylight*>(nullptr)}) try {
      chosen(photos, with(BackgroundChoice::kSky), missing);
      FAIL() << "no error";
    } catch (const InvalidInput& error) {
      EXPECT_THAT(error.what(),
                  HasSubstr(missing ? "is known: 2 night (n07)" : "no photograph whose sky is known"));
    }
}

TEST(BackgroundChoice, UniformBordersAreAConstant) {
  for (const std::array<float, 3>& border :
       {std::array<float, 3>{0, 0, 0}, std::array<float, 3>{0.02f, 0.02f, 0.025f},
        std::array<float, 3>{0.1f, 0.6f, 0.2f}}) {
    const Scene scene = chosen({photo_of(border, {1, 0, 0}, false), photo_of(border, {0, 0, 1}, false)}, {});
    EXPECT_EQ(scene.background.kind, BackgroundKind::kKnown);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(scene.background.mean[c], luv(border)[c], 1e-3);
    for (int c = 0; c < 6; ++c) EXPECT_NEAR(scene.background.cov[c], 0, 1e-2);
    EXPECT_THAT(scene.notes, ::testing::Contains(HasSubstr("constant")));
    EXPECT_FLOAT_EQ(scene.background.unknown_likelihood, 0.0007f);
  }
}

TEST(BackgroundChoice, NoiseOfTheBorderBecomesItsSpread) {
  Photograph photo = photo_of({0.2f, 0.2f, 0.2f}, {1, 0, 0}, false);
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, 0.008f);
  for (float& value : photo.rgb.data()) value += noise(random);
  const Scene scene = chosen({photo}, {});
  EXPECT_EQ(scene.background.kind, BackgroundKind::kKnown);
  EXPECT_GT(scene.background.cov[0], 0.05);
  EXPECT_LT(scene.background.cov[0], 9);
}

TEST(BackgroundChoice, TexturedBordersAreUnknown) {
  const Scene scene = chosen({textured_photo(1), textured_photo(2)}, {});
  EXPECT_EQ(scene.background.kind, BackgroundKind::kUnknown);
  EXPECT_THAT(scene.notes, ::testing::Contains(HasSubstr("unknown")));
}

TEST(BackgroundChoice, OneTexturedImageInFourIsUnknown) {
  const Photograph plain = photo_of({0, 0, 0}, {1, 0, 0}, false);
  EXPECT_EQ(chosen({plain, plain, plain, textured_photo(3)}, {}).background.kind, BackgroundKind::kUnknown);
}

TEST(BackgroundChoice, WhatIsAskedForIsObeyed) {
  const std::vector<Photograph> photos{photo_of({0.3f, 0.5f, 0.2f}, {1, 0, 0}, true), textured_photo(4)};
  EXPECT_EQ(chosen(photos, with(BackgroundChoice::kNone)).background.kind, BackgroundKind::kNone);
  EXPECT_EQ(chosen(photos, with(BackgroundChoice::kUnknown)).background.kind, BackgroundKind::kUnknown);
  const Scene black = chosen(photos, with(BackgroundChoice::kBlack));
  EXPECT_EQ(black.background.kind, BackgroundKind::kKnown);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(black.background.mean[c], 0, 1e-4);

  ReconstructOptions options = with(BackgroundChoice::kConstant);
  options.background_color = {0.1, 0.2, 0.8};
  const Scene constant = chosen(photos, options);
  EXPECT_EQ(constant.background.kind, BackgroundKind::kKnown);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(constant.background.mean[c], luv({0.1f, 0.2f, 0.8f})[c], 1e-3);
}

TEST(BackgroundChoice, AColorMeansAConstantAndNothingElse) {
  const std::vector<Photograph> photos{photo_of({0.3f, 0.5f, 0.2f}, {1, 0, 0}, true), textured_photo(4)};
  ReconstructOptions options = with(BackgroundChoice::kAuto);
  options.background_color = {0.1, 0.2, 0.8};
  const Scene implied = chosen(photos, options);
  EXPECT_EQ(implied.background.kind, BackgroundKind::kKnown);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(implied.background.mean[c], luv({0.1f, 0.2f, 0.8f})[c], 1e-3);
  for (const BackgroundChoice other : {BackgroundChoice::kNone, BackgroundChoice::kUnknown,
                                       BackgroundChoice::kBlack, BackgroundChoice::kMask}) {
    options.background = other;
    EXPECT_THROW(chosen(photos, options), InvalidInput);
  }
}

TEST(BackgroundChoice, AConstantIsEstimatedFromTheBordersWhereNoneIsGiven) {
  const Scene scene =
      chosen({photo_of({0.3f, 0.5f, 0.2f}, {1, 0, 0}, false)}, with(BackgroundChoice::kConstant));
  EXPECT_EQ(scene.background.kind, BackgroundKind::kKnown);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(scene.background.mean[c], luv({0.3f, 0.5f, 0.2f})[c], 1e-3);
}

TEST(BackgroundChoice, MasksAskedForMustBeThere) {
  const std::vector<Photograph> photos{photo_of({0, 0, 0}, {1, 0, 0}, true),
                                       photo_of({0, 0, 0}, {1, 0, 0}, false)};
  try {
    chosen(photos, with(BackgroundChoice::kMask));
    FAIL() << "no error";
  } catch (const InvalidInput& error) {
    EXPECT_THAT(error.what(), HasSubstr("--background mask"));
    EXPECT_THAT(error.what(), HasSubstr("1 masks for 2 images"));
  }
}

TEST(BackgroundChoice, UnusablePixelsTellNothing) {
  Photograph photo = photo_of({0, 0, 0}, {1, 0, 0}, false);
  const Photograph texture = textured_photo(5);
  photo.valid = Mask(64, 48, 255);
  for (int y = 0; y < 48; ++y)  // the left half of the border was never seen; its pixels are noise
    for (int x = 0; x < 32; ++x) {
      photo.valid.at(x, y) = 0;
      std::copy_n(texture.rgb.pixel(x, y), 3, photo.rgb.pixel(x, y));
    }
  EXPECT_EQ(chosen({photo}, {}).background.kind, BackgroundKind::kKnown);
}

}  // namespace
}  // namespace roxel

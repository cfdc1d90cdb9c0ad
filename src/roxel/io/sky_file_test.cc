#include "roxel/io/sky_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "roxel/base/error.h"
#include "roxel/base/temp_folder.h"
#include "roxel/io/image_file.h"
#include "roxel/io/sky_truth.h"
#include "roxel/sky/sky_fixture.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

class SkyFile : public ::testing::Test {
 protected:
  NodeSky sky() const {
    NodeSky s = clear_sky(200, 33.3);
    s.name = "n04";
    s.views = {"a", "b/c"};
    s.centres = {{1, 2, 1.0 / 3}, {-4, 5, 6e-9}};
    s.time_utc_s = 1061484600.25;
    s.latitude_deg = 42.36;
    s.sky_from_world << 0, 1, 0, -1, 0, 0, 0, 0, 1;
    s.residual_order = 1;
    for (auto& r : s.residual) r = {0.1, -0.2, 1.0 / 3, 0};
    s.relative_sigma = {0.01, 0.02, 1.0 / 7};
    s.clearness_bin = 7;
    s.sun_by_time = s.sun;
    s.mean_error = 0.0123;
    s.sun_relative_sigma = 0.17, s.inlier_share = 0.8, s.clipped_share = 0.06;
    s.sky_share = 0.4, s.seen_share = 0.9, s.mean_disagreement = 0.003;
    return s;
  }

  const TempFolder temporary_;
  const fs::path run_ = temporary_.path();
};

TEST_F(SkyFile, ReadsWhatItWroteExactly) {
  const NodeSky before = sky();
  write_sky(run_, before);
  const std::vector<NodeSky> skies = read_skies(run_);
  ASSERT_EQ(skies.size(), 1u);
  const NodeSky& after = skies[0];
  EXPECT_EQ(after.name, before.name);
  EXPECT_EQ(after.views, before.views);
  EXPECT_EQ(after.centres, before.centres);
  EXPECT_EQ(after.time_utc_s, before.time_utc_s);
  EXPECT_EQ(after.latitude_deg, before.latitude_deg);
  EXPECT_EQ(after.longitude_deg, before.longitude_deg);
  EXPECT_EQ(after.sky_from_world, before.sky_from_world);
  EXPECT_EQ(after.model, before.model);
  EXPECT_EQ(after.channels, before.channels);
  EXPECT_EQ(after.residual_order, before.residual_order);
  EXPECT_EQ(after.residual, before.residual);
  EXPECT_EQ(after.relative_sigma, before.relative_sigma);
  EXPECT_EQ(after.sun, before.sun);
  EXPECT_EQ(after.sun_source, before.sun_source);
  EXPECT_EQ(after.sun_by_time, before.sun_by_time);
  EXPECT_EQ(after.sun_by_images, before.sun_by_images);
  EXPECT_EQ(after.sun_light, before.sun_light);
  EXPECT_EQ(after.sun_irradiance, before.sun_irradiance);
  EXPECT_EQ(after.mean_error, before.mean_error);
  EXPECT_EQ(after.clearness_bin, before.clearness_bin);
  EXPECT_EQ(after.sky_share, before.sky_share);
  EXPECT_EQ(after.sun_relative_sigma, before.sun_relative_sigma);
  EXPECT_EQ(after.inlier_share, before.inlier_share);
  EXPECT_EQ(after.clipped_share, before.clipped_share);
}

TEST_F(SkyFile, WritesTheMapThatTheSkyMakes) {
  write_sky(run_, sky());
  const Image map = sky_map(sky(), Disc::kWithout);
  const Image read = read_image(sky_path(run_, "n04", "_nosun.exr").string()).rgb;
  ASSERT_EQ(read.width(), 512);
  EXPECT_EQ(read.data(), map.data());
  EXPECT_TRUE(fs::is_regular_file(sky_path(run_, "n04", ".exr")));
}

TEST_F(SkyFile, BadFilesAreNamedWithFieldFoundAndExpected) {
  write_sky(run_, sky());
  const fs::path file = sky_path(run_, "n04");
  std::ifstream in(file);
  const json good = json::parse(in);
  const std::vector<std::tuple<std::string, json, std::string>> table{
      {"/format", "other", "format: found \"other\", expected \"roxel sky\""},
      {"/version", 2, "version: found 2, expected a whole number from 1 to 1"},
      {"/model", "cloudy",
       "model: found \"cloudy\", expected one of none, uniform, published, gradation, perez"},
      {"/red/a", nullptr, "red: a: found null, expected a finite number"},
      {"/green/residual", json::array({1}), "green: residual: found [1], expected 4 numbers"},
      {"/residual_order", 9, "residual_order: found 9, expected a whole number from 0 to 4"},
      {"/sun/direction", json::array({1, 1, 0}),
       "sun: direction: found [1,1,0], expected a vector of length 1"},
      {"/sun/light", "some", "sun: light: found \"some\", expected one of none, measured, estimated"},
      {"/sky_from_world/0", json::array({1, 1, 0}), "sky_from_world: found"},
      {"/views", json::array({3}), "views: found 3, expected names of views"},
      {"/blue", 4, "blue: found number, expected an object"}};
  for (const auto& [pointer, value, message] : table) {
    json bad = good;
    bad[json::json_pointer(pointer)] = value;
    std::ofstream(file) << bad;
    try {
      read_sky(file);
      ADD_FAILURE() << pointer << " was taken";
    } catch (const InvalidInput& error) {
      EXPECT_THAT(error.what(), HasSubstr(file.string() + ": "));
      EXPECT_THAT(error.what(), HasSubstr(message));
    }
  }
  std::ofstream(file) << "{";
  EXPECT_THROW(read_sky(file), InvalidInput);
}

TEST_F(SkyFile, AMissingFieldIsNamed) {
  write_sky(run_, sky());
  const fs::path file = sky_path(run_, "n04");
  std::ifstream in(file);
  json bad = json::parse(in);
  bad.erase("mean_error");
  std::ofstream(file) << bad;
  try {
    read_sky(file);
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_THAT(error.what(), HasSubstr("mean_error: found nothing"));
  }
}

TEST_F(SkyFile, TwoFilesOfOneNodeAreAnError) {
  write_sky(run_, sky());
  fs::copy_file(sky_path(run_, "n04"), sky_path(run_, "n05"));
  EXPECT_THROW(read_skies(run_), InvalidInput);
  EXPECT_THROW(read_skies(run_ / "nowhere"), InvalidInput);
}

TEST(SkyMaskPath, StaysInTheRun) {
  EXPECT_EQ(sky_mask_path("run", "a/b.0001"), fs::path("run/sky/mask/a/b.0001.png"));
  EXPECT_EQ(sky_mask_path("run", "../../x"), fs::path("run/sky/mask/x.png"));
}

TEST_F(SkyFile, TruthIsReadAndBadTruthNamed) {
  fs::create_directories(run_);
  json node{{"node", 3},
            {"sun_direction", {0, 0, 1}},
            {"sun_disc", true},
            {"equirect_without_disc", "sky/a.exr"},
            {"sun_irradiance_normal_rgb", {1, 2, 3}},
            {"total_irradiance_horizontal_rgb", {1, 2, 3}},
            {"sky_irradiance_horizontal_rgb", {0.1, 0.2, 0.3}}};
  const auto write = [&] { std::ofstream(run_ / "illumination.json") << json{{"nodes", {node}}}; };
  write();
  EXPECT_TRUE(has_sky_truth(run_));
  const auto truths = read_sky_truth(run_);
  ASSERT_EQ(truths.size(), 1u);
  EXPECT_EQ(truths[0].node, "n03");
  EXPECT_EQ(truths[0].horizontal_sky[2], 0.3);
  EXPECT_EQ(truths[0].map_file, run_ / "sky/a.exr");
  node["sun_direction"] = {0, 1};
  write();
  try {
    read_sky_truth(run_);
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_THAT(error.what(), HasSubstr("nodes[0].sun_direction: found [0,1], expected three numbers"));
  }
}

}  // namespace
}  // namespace roxel

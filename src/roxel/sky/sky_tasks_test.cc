#include "roxel/sky/sky_tasks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

View view(const std::string& name, const Eigen::Vector3d& centre, std::optional<double> time = {},
          std::optional<int> node = {}) {
  View v;
  v.name = name;
  v.source = "frames of " + name;
  v.camera.pose.centre = centre;
  // Upright, looking north: x east, y down.
  v.camera.pose.rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  v.time_utc_s = time;
  v.node_id = node;
  return v;
}

Dataset dataset(std::vector<View> views) {
  Dataset d;
  d.views = std::move(views);
  assign_nodes(d);
  return d;
}

std::vector<std::string> names(const DatasetSkies& skies) {
  std::vector<std::string> out;
  for (const SkyTask& task : skies.tasks) out.push_back(task.name);
  return out;
}

TEST(SkyTasks, OneANodeByItsId) {
  const DatasetSkies skies = sky_tasks(
      dataset({view("a", {0, 0, 0}, 100, 3), view("b", {0, 0, 0}, 160, 3), view("c", {5, 0, 0}, 9000, 7)}));
  EXPECT_THAT(names(skies), ElementsAre("n03", "n07"));
  EXPECT_THAT(skies.tasks[0].views, ElementsAre("a", "b"));
  EXPECT_EQ(*skies.tasks[1].time_utc_s, 9000);
}

TEST(SkyTasks, SingleImagesOfOneTimeShareASky) {
  const DatasetSkies skies =
      sky_tasks(dataset({view("a", {0, 0, 0}, 500), view("b", {3, 0, 0}, 500), view("c", {6, 0, 0}, 900)}));
  EXPECT_THAT(names(skies), ElementsAre("n00", "n01"));
  EXPECT_THAT(skies.tasks[0].views, ElementsAre("a", "b"));
}

TEST(SkyTasks, OnePlaceAtTwoHoursHasTwoSkies) {
  const DatasetSkies skies = sky_tasks(dataset({view("a", {0, 0, 0}, 0), view("b", {0, 0, 0}, 60),
                                                view("c", {0, 0, 0}, 7200), view("d", {9, 0, 0}, 1)}));
  ASSERT_EQ(skies.tasks.size(), 3u);
  EXPECT_THAT(skies.tasks[0].views, ElementsAre("a", "b"));
  EXPECT_THAT(skies.tasks[1].views, ElementsAre("c"));
}

TEST(SkyTasks, TwoNodesOfOneNameAreAnErrorThatNamesTheFrames) {
  try {
    sky_tasks(dataset({view("a", {0, 0, 0}, 0, 2), view("b", {9, 0, 0}, 7200, 2)}));
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("frames of b: node 2: found a time 120 minutes from that of frames of a"));
  }
}

View placed(View v, double latitude, double longitude) {
  v.latitude_deg = latitude, v.longitude_deg = longitude;
  return v;
}

TEST(SkyTasks, OneNodeInTwoCitiesIsAnErrorThatNamesTheFrames) {
  const auto tasks = [](double latitude, double longitude) {
    return sky_tasks(dataset({placed(view("a", {0, 0, 0}, 0, 2), 42.36, -71.09), view("b", {0, 0, 0}, 0, 2),
                              placed(view("c", {0, 0, 0}, 0, 2), latitude, longitude)}));
  };
  EXPECT_EQ(tasks(42.365, -71.095).tasks.size(), 1u);
  for (const auto& [latitude, longitude, what] :
       {std::tuple{-33.0, -71.09, "a latitude of -33, while frames of a"},
        {42.36, 151.0, "a longitude of 151"}})
    try {
      tasks(latitude, longitude);
      FAIL();
    } catch (const InvalidInput& error) {
      EXPECT_THAT(error.what(), HasSubstr("frames of c: node 2: found "));
      EXPECT_THAT(error.what(), HasSubstr(what));
    }
  // Both sides of the date line are one place.
  EXPECT_EQ(sky_tasks(dataset({placed(view("a", {0, 0, 0}, 0, 2), 0, 179.999),
                               placed(view("b", {0, 0, 0}, 0, 2), 0, -179.999)}))
                .tasks.size(),
            1u);
}

TEST(SkyTasks, SingleImagesOfOneTimeInTwoCitiesHaveTwoSkies) {
  const DatasetSkies skies = sky_tasks(dataset(
      {placed(view("a", {0, 0, 0}, 500), 42.36, -71.09), placed(view("b", {3, 0, 0}, 500), 48.1, 11.6),
       placed(view("c", {6, 0, 0}, 500), 42.365, -71.095), placed(view("d", {9, 0, 0}, 500), 48.1, 11.6)}));
  ASSERT_THAT(names(skies), ElementsAre("n00", "n01"));
  EXPECT_THAT(skies.tasks[0].views, ElementsAre("a", "c"));
  EXPECT_THAT(skies.tasks[1].views, ElementsAre("b", "d"));
  EXPECT_EQ(skies.tasks[1].latitude_deg, 48.1);
}

/// Three nodes 10 apart, of two views each, and a view "x" of node 1 (which stands at 0) at a distance.
Dataset three_nodes_and(double distance) {
  std::vector<View> views;
  for (int n = 1; n <= 3; ++n)
    for (const char* name : {"a", "b"})
      views.push_back(view(name + std::to_string(n), {10.0 * (n - 1), 0, 0}, {}, n));
  views.push_back(view("x", {0, distance, 0}, {}, 1));
  return dataset(views);
}

TEST(SkyTasks, OneNodeInTwoPlacesFartherApartThanNodesIsAnErrorThatNamesTheFrames) {
  try {
    sky_tasks(three_nodes_and(30));
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_THAT(error.what(), HasSubstr("frames of x: node 1: found a camera 30 from that of frames of a1"));
    EXPECT_THAT(error.what(), HasSubstr("nodes are 10 apart"));
  }
}

TEST(SkyTasks, OneNodeInTwoPlacesThatMayBeALooseLabelIsAWarning) {
  const auto warnings = [](const Dataset& of) { return sky_tasks(of).warnings; };
  EXPECT_THAT(warnings(three_nodes_and(0.5)), ElementsAre());
  EXPECT_THAT(warnings(three_nodes_and(5)), ElementsAre(HasSubstr("frames of x: node 1: a camera 5 from")));
  // No other node says how far apart they are; and a path is no pair of places.
  EXPECT_THAT(warnings(dataset({view("a", {0, 0, 0}, {}, 4), view("b", {30, 0, 0}, {}, 4)})),
              ElementsAre(HasSubstr("frames of b: node 4: a camera 30 from that of frames of a")));
  std::vector<View> path;
  for (int i = 0; i < 12; ++i) path.push_back(view("p" + std::to_string(i), {double(i), 0, 0}, {}, 4));
  EXPECT_THAT(warnings(dataset(path)), ElementsAre());
  EXPECT_THAT(warnings(dataset({view("a", {0, 0, 0}), view("b", {30, 0, 0})})), ElementsAre());
}

TEST(SkyTasks, UpIsWhereCamerasHoldItThoughTheyTilt) {
  // A world with up = -Y; cameras look around and tilt up by 40 degrees.
  std::vector<View> views;
  const Eigen::Matrix3d world = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  for (int i = 0; i < 6; ++i) {
    View v = view("v" + std::to_string(i), {double(i), 0, 0});
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.5 * i, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Matrix3d tilt = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX()).toRotationMatrix();
    v.camera.pose.rotation = tilt * v.camera.pose.rotation * turn * world;
    views.push_back(v);
  }
  const DatasetSkies skies = sky_tasks(dataset(views));
  const Eigen::Vector3d up = skies.tasks[0].sky_from_world.transpose() * Eigen::Vector3d::UnitZ();
  EXPECT_LT((up - world.transpose() * Eigen::Vector3d::UnitZ()).norm(), 1e-6);
  ASSERT_EQ(skies.notes.size(), 1u);
  EXPECT_THAT(skies.notes[0], HasSubstr("--up"));
}

TEST(SkyTasks, UpByHandComesFirstAndPlacesMeanZ) {
  std::vector<View> views{view("a", {0, 0, 0})};
  const DatasetSkies given = sky_tasks(dataset(views), std::array<double, 3>{0, 2, 0});
  EXPECT_LT((given.tasks[0].sky_from_world * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm(),
            1e-12);
  views[0].camera.pose.rotation = Eigen::Matrix3d::Identity();  // looks up
  views[0].latitude_deg = 48, views[0].longitude_deg = 11;
  EXPECT_TRUE(sky_tasks(dataset(views)).tasks[0].sky_from_world.isIdentity());
}

TEST(SkyPictureOf, FinePixelsAreMadeSmallerAndClipWhereOneOfThemDoes) {
  View fine = view("fine", {0, 0, 0});
  fine.camera.intrinsics = {42, 30, 3600, 3600, 21, 15, 0};  // a pixel is 0.016 degrees
  ASSERT_EQ(sky_scale(fine.camera), 3);
  Photograph photo;
  photo.rgb = Image(42, 30, 3, 0.5f);
  photo.rgb.pixel(0, 0)[1] = 0.8f;
  photo.rgb.pixel(10, 4)[2] = 1.0f;  // white is 1: it clips
  photo.valid = Mask(42, 30, 255);
  photo.valid.at(41, 29) = 0;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const SkyPicture full_mask = sky_picture(fine, photo, turn, Mask(42, 30, 255));
  EXPECT_EQ(full_mask.known_sky.width(), 14);
  const SkyPicture picture = sky_picture(fine, photo, turn);
  EXPECT_EQ(picture.scale, 3);
  ASSERT_EQ(picture.rgb.width(), 14);
  ASSERT_EQ(picture.rays.width(), 14);
  ASSERT_EQ(picture.rays.height(), 10);
  EXPECT_NEAR(picture.rgb.pixel(0, 0)[1], 0.5 + 0.3 / 9, 1e-6);
  EXPECT_EQ(picture.rgb.pixel(3, 1)[2], 1.0f);
  EXPECT_EQ(picture.rgb.pixel(3, 1)[0], 0.5f);
  EXPECT_GE(picture.rgb.pixel(3, 1)[2], picture.clip);
  EXPECT_EQ(picture.rgb.pixel(4, 1)[2], 0.5f);
  EXPECT_EQ(picture.valid.at(13, 9), 0);
  EXPECT_TRUE(picture.known_sky.empty());
  const PixelRays rays(fine.camera, turn);
  EXPECT_LT((picture.rays.direction(2, 5) - rays.direction(6, 15)).norm(), 1e-12);
  fine.camera.intrinsics.fx = fine.camera.intrinsics.fy = 1000;  // 0.057 degrees
  EXPECT_EQ(sky_picture(fine, photo, turn).scale, 1);
  EXPECT_EQ(sky_picture(fine, photo, turn).rgb.data(), photo.rgb.data());
}

TEST(SkyPictureOf, APhotographLowerThanASquareIsOnePixelHigh) {
  View fine = view("fine", {0, 0, 0});
  fine.camera.intrinsics = {42, 2, 3600, 3600, 21, 1, 0};
  Photograph photo;
  photo.rgb = Image(42, 2, 3, 0.5f);
  photo.rgb.pixel(41, 1)[2] = 1.0f;
  const SkyPicture picture = sky_picture(fine, photo, Eigen::Matrix3d::Identity());
  ASSERT_EQ(picture.rgb.height(), 1);
  ASSERT_EQ(picture.rgb.width(), 14);
  EXPECT_EQ(picture.rgb.pixel(13, 0)[2], 1.0f);
  EXPECT_FLOAT_EQ(picture.rgb.pixel(12, 0)[2], 0.5f);
}

TEST(SkyWorkers, AreAsManyAsMemoryAllows) {
  EXPECT_EQ(sky_workers(24'000'000, 4e9, 16), 5);  // 0.77 GB each
  EXPECT_EQ(sky_workers(24'000'000, 4e9, 2), 2);
  EXPECT_EQ(sky_workers(24'000'000, 1e6, 2), 1);
  EXPECT_EQ(sky_workers(1, std::numeric_limits<double>::infinity(), 8), 8);
}

}  // namespace
}  // namespace roxel

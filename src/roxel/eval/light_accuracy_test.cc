#include "roxel/eval/light_accuracy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "roxel/eval/true_light.h"

namespace roxel {
namespace {

/// Looks down at the plane z = 0 from a height of 10, rows along -y.
DepthView from_above(double x, int node) {
  DepthView view;
  view.node = node;
  view.camera.pose.rotation = Eigen::Vector3d(1, -1, -1).asDiagonal();
  view.camera.pose.centre = {x, 0, 10};
  view.camera.intrinsics = {40, 40, 40, 40, 20, 20, 0};
  view.depth = Image(40, 40, 1);
  for (float& z : view.depth.data()) z = 10;
  return view;
}

std::vector<DepthView> four_views() {
  return {from_above(0, 0), from_above(0.5, 0), from_above(1, 1), from_above(2, 2)};
}

TEST(SharedPlaces, AreThoseThatEnoughNodesSee) {
  const std::vector<DepthView> views = four_views();
  const std::vector<SharedPlace> places = shared_places(views, {3, 4, 0.01}, 2);
  ASSERT_FALSE(places.empty());
  for (const SharedPlace& place : places) {
    EXPECT_NEAR(place.x.z(), 0, 1e-9);
    EXPECT_GT(place.x.x(), -5 + 2);   // the last view sees no further to the left
    EXPECT_LT(place.x.x(), 0.5 + 5);  // nor node 0 to the right
    ASSERT_GE(place.sightings.size(), 3u);
    for (const PlaceSighting& seen : place.sightings)
      EXPECT_NEAR(views[seen.view].camera.project(place.x).x(), seen.x + 0.5, 0.51);
  }
  EXPECT_TRUE(shared_places(views, {4, 4, 0.01}, 1).empty());
}

TEST(SharedPlaces, LeaveOutWhatIsHidden) {
  std::vector<DepthView> views = four_views();
  for (float& z : views[3].depth.data()) z = 6;  // something stands before it
  EXPECT_TRUE(shared_places(views, {3, 4, 0.01}, 1).empty());
}

TEST(ColorSpread, IsTheDeviationOfLogColourBetweenNodes) {
  const std::vector<DepthView> views = four_views();
  const std::vector<SharedPlace> places = shared_places(views, {3, 4, 0.01}, 1);
  // Nodes 0, 1, 2 at log colours 0, d, 2 d: deviation d.
  const auto color = [&](std::size_t p, std::size_t s) -> std::optional<Eigen::Vector3d> {
    return Eigen::Vector3d::Constant(std::exp(0.3 * views[places[p].sightings[s].view].node));
  };
  const ColorSpread spread = color_spread(views, places, color, 3);
  EXPECT_EQ(spread.places, static_cast<std::int64_t>(places.size()));
  EXPECT_NEAR(spread.mean, 0.3, 1e-9);
  EXPECT_NEAR(spread.median, 0.3, 1e-9);
  const auto none = [](std::size_t, std::size_t) { return std::optional<Eigen::Vector3d>(); };
  EXPECT_EQ(color_spread(views, places, none, 3).places, 0);
}

TEST(LogError, LeavesOneScaleFree) {
  const std::vector<ColorPair> pairs{{{2, 4, 6}, {1, 2, 3}}, {{4, 8, 12}, {1, 2, 3}}, {{1, 1, 1}, {0, 1, 1}}};
  const LogError error = log_error(pairs);
  EXPECT_EQ(error.pixels, 2);  // black has no logarithm
  EXPECT_NEAR(error.mean, std::log(2) / 2, 1e-6);
  EXPECT_NEAR(log_error({{{2, 4, 6}, {1, 2, 3}}}).mean, 0, 1e-6);
  EXPECT_EQ(log_error({}).pixels, 0);
}

TEST(MeanColor, IsOfNinePixelsAndOnlyWhereAllAreKnown) {
  Image rgb(3, 3, 3);
  for (std::size_t i = 0; i < rgb.data().size(); ++i) rgb.data()[i] = 1 + static_cast<float>(i % 3);
  EXPECT_EQ(mean_color(rgb, {0, 1, 1})->cast<float>(), Eigen::Vector3f(1, 2, 3));
  rgb.pixel(2, 2)[1] = 0;
  EXPECT_FALSE(mean_color(rgb, {0, 1, 1}));
}

/// The ground, and a wall along y at x = 3 that is 100 high.
Mesh ground_and_wall() {
  Mesh mesh;
  mesh.points = {{-100, -100, 0}, {100, -100, 0}, {100, 100, 0}, {-100, 100, 0},
                 {3, -100, 0},    {3, 100, 0},    {3, 100, 100}, {3, -100, 100}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  return mesh;
}

TrueSky white_sky() {
  TrueSky sky{Image(64, 32, 3), Eigen::Vector3d(1, 0, 1).normalized(),
              Eigen::Vector3d::Constant(std::numbers::pi)};
  for (float& value : sky.map.data()) value = 1;
  return sky;
}

TEST(TrueLight, OnOpenGroundIsThatOfTheDomeAndTheSun) {
  const Mesh mesh = ground_and_wall();
  TrueSky without_sun = white_sky();
  without_sun.sun_irradiance.setZero();
  const TrueLight light(mesh, {white_sky(), without_sun});
  const auto found = light.at({50, 0, 0}, {60, 0, 5});  // beyond the wall; the sun is further beyond
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0][0] - found[1][0], std::sqrt(0.5), 0.06);  // and what the wall gives back of the sun
  EXPECT_NEAR(found[1][1], 1, 0.25);                             // the wall hides some
}

TEST(TrueLight, InAShadowIsThatOfTheSkyThatIsSeen) {
  const Mesh mesh = ground_and_wall();
  const TrueLight light(mesh, {white_sky()});
  const auto found = light.at({2.9, 0, 0}, {0, 0, 5});  // at the foot of the wall: half of the dome, no sun
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0][2], 0.5 + 0.5 * 0.3 * 0.5, 0.05);  // the wall gives back 0.3 of half a dome
  EXPECT_TRUE(light.at({10, 0, 0}, {0, 0, 5}).empty());   // the wall stands before it
}

}  // namespace
}  // namespace roxel

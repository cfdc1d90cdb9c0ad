#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "roxel/synth/lights.h"
#include "roxel/synth/ray_scene.h"
#include "roxel/synth/street_block.h"
#include "roxel/synth/world.h"

namespace roxel {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr WorldKind kAll[] = {WorldKind::kPlane, WorldKind::kHead,   WorldKind::kMug,
                              WorldKind::kTable, WorldKind::kStreet, WorldKind::kFlights};

World small_world(WorldKind kind, int images = 6, std::uint32_t seed = 1) {
  return make_world(kind, {images, 48, 36, seed});
}

/// Number of surfaces along a ray.
int crossings(const RayScene& scene, Vector3f origin, const Vector3f& direction) {
  int count = 0;
  for (auto hit = scene.trace(origin, direction); hit; hit = scene.trace(origin, direction)) {
    ++count;
    origin += (hit->distance + 1e-4f) * direction;
  }
  return count;
}

TEST(Worlds, AreFoundByName) {
  for (const char* name : {"plane", "head", "mug", "table", "street", "flights"})
    EXPECT_TRUE(find_world(name).has_value()) << name;
  EXPECT_FALSE(find_world("demo").has_value());
  EXPECT_FALSE(find_world("").has_value());
}

TEST(Worlds, HaveTheSizesOfTheirModels) {
  const auto is = [](WorldKind kind, int images, int width, int height) {
    const WorldDefaults d = world_defaults(kind);
    return d.images == images && d.width == width && d.height == height;
  };
  EXPECT_TRUE(is(WorldKind::kPlane, 15, 400, 300));
  EXPECT_TRUE(is(WorldKind::kHead, 20, 400, 300));
  EXPECT_TRUE(is(WorldKind::kMug, 24, 352, 288));
  EXPECT_TRUE(is(WorldKind::kTable, 24, 640, 480));
  EXPECT_TRUE(is(WorldKind::kStreet, 160, 324, 256));
  EXPECT_TRUE(is(WorldKind::kFlights, 60, 640, 480));
}

// Every camera sees into the box, none stands in a wall, and nothing of an object leaves its box.
TEST(Worlds, CamerasSeeTheBoxAndMaterialsExist) {
  for (const WorldKind kind : kAll) {
    const World world = small_world(kind, 7);
    ASSERT_EQ(world.shots.size(), 7u);
    for (std::uint16_t material : world.mesh.materials) ASSERT_LT(material, world.materials.size());
    ASSERT_EQ(world.mesh.materials.size(), world.mesh.triangles.size());
    std::set<std::string> names;
    for (const Shot& shot : world.shots) {
      names.insert(shot.name);
      EXPECT_LT(shot.occasion, static_cast<int>(world.times_utc_s.size()));
      const Eigen::Matrix3d& r = shot.camera.pose.rotation;
      EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
      EXPECT_NEAR(r.determinant(), 1, 1e-12);
      if (kind == WorldKind::kStreet) continue;  // its nodes look around, and up
      const Vector3d middle = shot.camera.project(world.bounds.center());
      EXPECT_GT(middle.z(), 0) << static_cast<int>(kind);
      EXPECT_TRUE(middle.x() > 0 && middle.x() < 48 && middle.y() > -20 && middle.y() < 56)
          << static_cast<int>(kind);
      EXPECT_LE(r(1, 2), 0.02);  // the image's down is not up
    }
    EXPECT_EQ(names.size(), 7u);
  }
  for (const WorldKind kind : {WorldKind::kPlane, WorldKind::kHead, WorldKind::kMug}) {
    const World world = small_world(kind);
    EXPECT_TRUE(world.bounds.contains(Eigen::AlignedBox3d(world.mesh.bounds().min().cast<double>(),
                                                          world.mesh.bounds().max().cast<double>())));
  }
}

TEST(Worlds, SeedsChangeColoursAndAlbedoIsAReflectance) {
  for (const WorldKind kind : kAll) {
    const World one = small_world(kind, 2, 1), two = small_world(kind, 2, 2);
    ASSERT_EQ(one.materials.size(), two.materials.size());
    int differ = 0, same_again = 0;
    const World again = small_world(kind, 2, 1);
    for (std::size_t m = 0; m < one.materials.size(); ++m)
      for (int i = 0; i < 40; ++i) {
        const Vector3f p(0.37f * i, -0.21f * i, 0.05f * i);
        const Vector3f normal = i % 2 ? Vector3f::UnitZ() : Vector3f::UnitY();
        const Vector3f albedo = one.materials[m](p, normal);
        ASSERT_TRUE((albedo.array() >= 0).all() && (albedo.array() <= 1).all());
        differ += albedo != two.materials[m](p, normal);
        same_again += albedo == again.materials[m](p, normal);
      }
    EXPECT_GT(differ, 0);
    EXPECT_EQ(same_again, static_cast<int>(40 * one.materials.size()));
  }
}

TEST(Mug, IsHollowAndHasAHoleInItsHandle) {
  const World world = small_world(WorldKind::kMug);
  const RayScene scene(world.mesh);
  // Down into it: the bottom's inside, above the table.
  const auto down = scene.trace({0, 0, 5}, -Vector3f::UnitZ());
  ASSERT_TRUE(down);
  EXPECT_NEAR(5 - down->distance, 0.04f, 1e-3);
  // Across it, clear of the handle: through two walls, each with two faces.
  EXPECT_EQ(crossings(scene, {0.1f, -3, 0.4f}, Vector3f::UnitY()), 4);
  // The handle stands out along +X: a ray across it meets the rod, one through its hole nothing.
  EXPECT_EQ(crossings(scene, {0.53f, -3, 0.41f}, Vector3f::UnitY()), 0);
  EXPECT_EQ(crossings(scene, {0.71f, -3, 0.41f}, Vector3f::UnitY()), 2);
  EXPECT_EQ(crossings(scene, {0.85f, -3, 0.41f}, Vector3f::UnitY()), 0);
  // Its section is round.
  for (int i = 0; i < 36; ++i) {
    const float turn = 0.3f + 5.6f * static_cast<float>(i) / 36;
    const Vector3f out(std::cos(turn), std::sin(turn), 0);
    const auto wall = scene.trace(Vector3f(0, 0, 0.75f), out);
    ASSERT_TRUE(wall);
    EXPECT_NEAR(wall->distance, 0.36f, 2e-3);
  }
}

TEST(Head, IsPartlyPlainAndPartlyTextured) {
  const World world = small_world(WorldKind::kHead);
  const RayScene scene(world.mesh);
  const auto variation = [&](const Vector3f& toward) {
    std::set<float> reds;
    for (int i = 0; i < 60; ++i) {
      const Vector3f origin = 4 * toward + Vector3f(0.01f * (i % 8), 0.01f * (i % 8), 0.008f * (i / 8));
      const auto hit = scene.trace(origin, -toward);
      if (hit) reds.insert(world.materials[hit->material](origin - hit->distance * toward, hit->normal).x());
    }
    return reds.size();
  };
  EXPECT_EQ(variation(Vector3f(0.65f, -0.7f, -0.08f).normalized()), 1u);  // a cheek
  EXPECT_GT(variation(Vector3f(0, 1, 0.05f).normalized()), 50u);          // the hair
}

TEST(Table, IsSeenWithinARoomThatFillsEveryPhotograph) {
  const World world = make_world(WorldKind::kTable, {24, 64, 48, 1});
  EXPECT_FALSE(world.masked);
  const RayScene scene(world.mesh);
  std::set<int> heights;
  for (const Shot& shot : world.shots) {
    heights.insert(static_cast<int>(std::lround(100 * shot.camera.pose.centre.z())));
    int beyond = 0;
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x) {
        const Ray ray = shot.camera.ray(x + 0.5, y + 0.5);
        const auto hit = scene.trace(ray.origin.cast<float>(), ray.direction.cast<float>());
        ASSERT_TRUE(hit) << shot.name << " " << x << " " << y;
        beyond += !world.bounds.contains(ray.origin + hit->distance * ray.direction);
      }
    EXPECT_GT(beyond, 64 * 48 / 4);
  }
  EXPECT_EQ(heights.size(), 3u);
}

TEST(Street, NodesAreTenMetresApartUnderTheOpenSkyAndTileIt) {
  const World world = make_world(WorldKind::kStreet, {280, 81, 64, 1});
  ASSERT_EQ(world.times_utc_s.size(), 14u);
  EXPECT_EQ(std::set<double>(world.times_utc_s.begin(), world.times_utc_s.end()).size(), 14u);
  const RayScene scene(world.mesh);
  for (int node = 0; node < 14; ++node) {
    const Vector3d centre = world.shots[20 * node].camera.pose.centre;
    EXPECT_FALSE(scene.occluded(centre.cast<float>(), Vector3f(0.02f, 0.01f, 1), 0, 1000)) << node;
    for (int k = 0; k < 20; ++k) {
      EXPECT_EQ(world.shots[20 * node + k].camera.pose.centre, centre);
      EXPECT_EQ(world.shots[20 * node + k].occasion, node);
    }
    double nearest = 1e9;
    for (int other = 0; other < 14; ++other)
      if (other != node)
        nearest = std::min(nearest, (world.shots[20 * other].camera.pose.centre - centre).norm());
    EXPECT_GT(nearest, 5) << node;
    EXPECT_LT(nearest, 13) << node;
  }
  // Every direction above the horizon is in some image of a node.
  for (int i = 0; i < 2000; ++i) {
    const double up = (i + 0.5) / 2000, turn = 2.399963 * i, flat = std::sqrt(1 - up * up);
    const Vector3d far =
        world.shots[0].camera.pose.centre + 100 * Vector3d(flat * std::cos(turn), flat * std::sin(turn), up);
    int seen = 0;
    for (int k = 0; k < 20; ++k) {
      const Vector3d pixel = world.shots[k].camera.project(far);
      seen += pixel.z() > 0 && pixel.x() > 0 && pixel.y() > 0 && pixel.x() < 81 && pixel.y() < 64;
    }
    EXPECT_GT(seen, 0) << up << " " << turn;
  }
}

TEST(Street, HasSetBackWindowsLedgesAndArches) {
  World world;
  build_street_block(world, 1);
  const RayScene scene(world.mesh);
  const Eigen::Affine3f frame = street_frame();
  // Rays at the northern fronts: walls and what is set back in them or stands out from them.
  std::set<int> depths;
  for (int i = 0; i < 4000; ++i) {
    const Vector3f from(-40 + 80.0f * (i % 80) / 80, 7.8f, 1 + 9.0f * (i / 80) / 50);
    const auto hit = scene.trace(frame * from, frame.linear() * Vector3f(0, 1, 0));
    if (hit) depths.insert(static_cast<int>(10 * hit->distance));
  }
  EXPECT_GT(depths.size(), 12u);
  EXPECT_GT(world.mesh.triangles.size(), 30000u);
}

TEST(Flights, AreThreeOfDifferentTimesLookingDownAndAslant) {
  const World world = make_world(WorldKind::kFlights, {60, 64, 48, 1});
  ASSERT_EQ(world.times_utc_s.size(), 3u);
  int per_flight[3] = {}, down = 0, aslant = 0;
  for (const Shot& shot : world.shots) {
    ++per_flight[shot.occasion];
    const double dip = -shot.camera.pose.rotation(2, 2);
    dip > 0.99 ? ++down : ++aslant;
    EXPECT_GT(dip, 0.4);
    EXPECT_GT(shot.camera.pose.centre.z(), 30);
  }
  for (int count : per_flight) EXPECT_EQ(count, 20);
  EXPECT_EQ(down, 24);
  EXPECT_EQ(aslant, 36);
}

World outdoors(int occasions) {
  World world;
  world.outdoors = true;
  for (int i = 0; i < occasions; ++i) world.times_utc_s.push_back(1686812400.0 + i * 90000.0);
  return world;
}

TEST(Lights, AreOneOrAsManyAsOccasions) {
  World indoors = outdoors(3);
  indoors.outdoors = false;
  const Lights studio_light = make_lights(indoors, {}, RunContext(2));
  ASSERT_EQ(studio_light.all.size(), 1u);
  EXPECT_FALSE(studio_light.all[0].time_utc_s);
  const Lights noon = make_lights(outdoors(3), {}, RunContext(2));
  ASSERT_EQ(noon.all.size(), 1u);
  EXPECT_EQ(noon.of_occasion, std::vector<int>({0, 0, 0}));
  EXPECT_TRUE(noon.all[0].time_utc_s);
  const Lights mixed = make_lights(outdoors(3), {LightKind::kMix, true, 1}, RunContext(2));
  ASSERT_EQ(mixed.all.size(), 3u);
  EXPECT_EQ(mixed.all[0].sky, "clear");
  EXPECT_EQ(mixed.all[1].sky, "overcast");
  EXPECT_EQ(mixed.all[2].sky, "partly cloudy");
  EXPECT_TRUE(mixed.all[1].environment.sun().irradiance.isZero());
  EXPECT_GT(mixed.all[2].environment.sun().irradiance.x(), 1);
}

TEST(Lights, ShadowsMoveOnlyWhereTheyMay) {
  const Lights moving = make_lights(outdoors(2), {LightKind::kDaylight, true, 1}, RunContext(2));
  const Lights still = make_lights(outdoors(2), {LightKind::kDaylight, false, 1}, RunContext(2));
  const auto sun = [](const Lights& lights, int i) { return lights.all[i].environment.sun(); };
  EXPECT_GT((sun(moving, 0).direction - sun(moving, 1).direction).norm(), 0.1f);
  EXPECT_EQ(sun(still, 0).direction, sun(still, 1).direction);
  EXPECT_NE(sun(still, 0).irradiance, sun(still, 1).irradiance);  // their haze differs
}

}  // namespace
}  // namespace roxel

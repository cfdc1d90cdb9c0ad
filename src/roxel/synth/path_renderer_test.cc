#include "roxel/synth/path_renderer.h"
#include "roxel/base/angles.h"

#include <gtest/gtest.h>

#include <cmath>

#include "roxel/synth/camera_paths.h"
#include "roxel/synth/mesh_builder.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

Environment uniform_sky(float radiance) {
  return Environment([=](const Vector3f&) { return Vector3f::Constant(radiance); }, {});
}

/// As bright as a uniform sky of 1 on the ground, but most of it from around one direction, and all above.
Environment peaked_sky() {
  const Vector3f spot = Vector3f(0.3f, -0.5f, 0.8f).normalized();
  return Environment(
      [=](const Vector3f& d) {
        return Vector3f(
            Vector3f::Constant(d.z() < 0 ? 0 : 0.5f + 30 * std::pow(std::max(d.dot(spot), 0.0f), 100.0f)));
      },
      {});
}

std::vector<Texture> flat(float albedo) {
  return {[=](const Vector3f&, const Vector3f&) { return Vector3f(Vector3f::Constant(albedo)); }};
}

PinholeCamera camera_at(const Vector3d& centre, const Vector3d& target, int width = 24, int height = 24,
                        double focal = 2) {
  return {simple_intrinsics(width, height, focal), looking_at(centre, target)};
}

/// A world of one material, and pictures of it.
struct Studio {
  TriangleMesh mesh;
  PathOptions options;
  Picture picture(const PinholeCamera& camera, const Environment& sky, float albedo) const {
    const RayScene scene(mesh);
    const std::vector<Texture> materials = flat(albedo);
    return PathRenderer(scene, scene, materials, sky, options).render(camera, 0, RunContext(1));
  }
};

double mean(const Image& image) {
  double sum = 0;
  for (float value : image.data()) sum += value;
  return sum / static_cast<double>(image.data().size());
}

// A white body cannot be told from a sky of one brightness, however the sky is looked for.
TEST(WhiteFurnace, AConvexBodyVanishes) {
  Studio studio;
  MeshBuilder(studio.mesh).ellipsoid({0, 0, 0}, {1, 0.8f, 1.2f}, 64);
  const Picture picture = studio.picture(camera_at({0, -5, 1}, {0, 0, 0}), uniform_sky(1), 1);
  for (float value : picture.rgb.data()) EXPECT_NEAR(value, 1, 1e-4f);
  EXPECT_GT(picture.mask.at(12, 12), 250);
}

TEST(WhiteFurnace, AHollowBodyVanishesAfterManyBounces) {
  Studio studio;
  studio.options.bounces = 200;
  studio.options.samples = 8;
  const Vector2f cup[] = {{0, 0}, {1, 0}, {1, 1}, {0.9f, 1}, {0.9f, 0.1f}, {0, 0.1f}};
  MeshBuilder(studio.mesh).lathe(cup, 48);
  const Picture picture = studio.picture(camera_at({0, -3, 4}, {0, 0, 0.4}), uniform_sky(1), 1);
  for (float value : picture.rgb.data()) EXPECT_NEAR(value, 1, 1e-3f);
}

TEST(WhiteFurnace, AGreyBodyIsAsBrightAsItsAlbedo) {
  Studio studio;
  MeshBuilder(studio.mesh).ellipsoid({0, 0, 0}, Vector3f::Ones(), 64);
  const Picture picture = studio.picture(camera_at({0, -5, 0}, {0, 0, 0}, 9, 9, 20), uniform_sky(2), 0.3f);
  for (float value : picture.rgb.data()) EXPECT_NEAR(value, 0.6f, 1e-3f);
}

// Radiance is albedo times irradiance over pi.
TEST(PathRenderer, APlaneReflectsTheIrradianceOfAPeakedSky) {
  Studio studio;
  studio.options.samples = 64;
  MeshBuilder(studio.mesh).quad({-50, -50, 0}, {50, -50, 0}, {50, 50, 0}, {-50, 50, 0});
  const Environment sky = peaked_sky();
  const Picture picture = studio.picture(camera_at({0, 0, 5}, {0, 0, 0}), sky, 0.5f);
  EXPECT_NEAR(mean(picture.rgb) / (0.5 * sky.sky_irradiance().x() / kPiFloat), 1, 0.01);
}

TEST(PathRenderer, AnOpeningThatIsLookedForGivesTheLightThatChanceFinds) {
  Studio studio;
  studio.options.samples = 256;
  MeshBuilder build(studio.mesh);
  // A room without a ceiling.
  build.quad({-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0});
  for (int side = 0; side < 4; ++side) {
    build.place(placed({0, 0, 0}, side * kPiFloat / 2));
    build.quad({-2, 2, 0}, {2, 2, 0}, {2, 2, 3}, {-2, 2, 3});
  }
  const PinholeCamera camera = camera_at({0, -1, 1.5}, {0, 0.3, 0}, 8, 8, 2);
  const double by_chance = mean(studio.picture(camera, uniform_sky(1), 0.5f).rgb);
  studio.options.skylight = Skylight{{Vector2f(-2, -2), Vector2f(2, 2)}, 3};
  const double looked_for = mean(studio.picture(camera, uniform_sky(1), 0.5f).rgb);
  EXPECT_NEAR(looked_for / by_chance, 1, 0.02);
}

Environment only_sun(const Vector3f& direction) {
  Sun sun;
  sun.direction = direction.normalized();
  sun.irradiance = Vector3f::Constant(kPiFloat);
  return Environment([](const Vector3f&) { return Vector3f(Vector3f::Zero()); }, sun);
}

// A pole of height 1 at the origin: the tip's shadow is where a ray from the sun through it meets the ground.
TEST(PathRenderer, APolesShadowPointsAwayFromTheSun) {
  Studio studio;
  studio.options.bounces = 0;
  MeshBuilder build(studio.mesh);
  build.quad({-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0});
  build.cylinder({0, 0, 0}, {0, 0, 1}, 0.03f, 16);
  const PinholeCamera camera = camera_at({0, 0, 8}, {0, 0, 0}, 160, 160, 1.6);
  for (const Vector3f& to_sun :
       {Vector3f(1, 0.5f, 1), Vector3f(-0.7f, 0.2f, 0.6f), Vector3f(0.1f, -1, 0.9f)}) {
    const Picture picture = studio.picture(camera, only_sun(to_sun), 1);
    const float lit = to_sun.normalized().z();
    Vector3d tip = Vector3d::Zero();
    int on_ground = 0, dark_pixels = 0, half_dark = 0;
    for (int y = 0; y < 160; ++y)
      for (int x = 0; x < 160; ++x) {
        const Ray ray = camera.ray(x + 0.5, y + 0.5);
        const Vector3d p = ray.origin - ray.origin.z() / ray.direction.z() * ray.direction;
        const bool ground = std::abs(*picture.depth.pixel(x, y) - 8) < 1e-3f;
        const bool dark = ground && picture.rgb.pixel(x, y)[0] < 0.5f * lit;
        if (dark && p.norm() > tip.norm()) tip = p;
        on_ground += ground, dark_pixels += dark;
        half_dark += ground && !dark && std::abs(picture.rgb.pixel(x, y)[0] / lit - 1) > 0.02f;
      }
    EXPECT_GT(on_ground, 20000);  // of 25600
    EXPECT_GT(dark_pixels, 20);
    EXPECT_LT(half_dark, 2 * dark_pixels + 20);  // at the shadow's rim
    const Vector3f expected = -to_sun / to_sun.z();
    EXPECT_LT((tip.head<2>().cast<float>() - expected.head<2>()).norm(), 0.1f) << to_sun.transpose();
  }
}

TEST(PathRenderer, TheTruthIsThatOfTheTriangles) {
  Studio studio;
  MeshBuilder(studio.mesh).box({-1, -1, -1}, {1, 1, 1});
  const PinholeCamera camera = camera_at({0.5, -4, 0.25}, {0.5, 0, 0.25}, 31, 31, 1.5);
  const Picture picture = studio.picture(camera, uniform_sky(1), 0.4f);
  EXPECT_NEAR(*picture.depth.pixel(15, 15), 3, 1e-5);
  EXPECT_EQ(picture.mask.at(15, 15), 255);
  EXPECT_NEAR(picture.normal.pixel(15, 15)[1], -1, 1e-6);
  EXPECT_NEAR(picture.albedo.pixel(15, 15)[0], 0.4f, 1e-6);
  EXPECT_EQ(*picture.depth.pixel(0, 0), 0);
  EXPECT_EQ(picture.mask.at(0, 0), 0);
  EXPECT_EQ(picture.normal.pixel(0, 0)[1], 0);
}

TEST(PathRenderer, BlackBehindTheWorldWhereTheSkyIsNotSeen) {
  Studio studio;
  MeshBuilder(studio.mesh).ellipsoid({0, 0, 0}, Vector3f::Ones(), 32);
  const PinholeCamera camera = camera_at({0, -5, 0}, {0, 0, 0});
  const Picture seen = studio.picture(camera, uniform_sky(1), 0.5f);
  studio.options.environment_seen = false;
  const Picture black = studio.picture(camera, uniform_sky(1), 0.5f);
  EXPECT_NEAR(seen.rgb.pixel(0, 0)[0], 1, 1e-5);
  EXPECT_EQ(black.rgb.pixel(0, 0)[0], 0);
  EXPECT_EQ(black.rgb.pixel(12, 12)[0], seen.rgb.pixel(12, 12)[0]);
}

// Smoothing takes grain out of the corner of a room and leaves its mean.
TEST(PathRenderer, SmoothingKeepsTheMeanAndTakesTheGrain) {
  Studio studio;
  studio.options.samples = 4;
  MeshBuilder build(studio.mesh);
  build.quad({-20, -20, 0}, {20, -20, 0}, {20, 20, 0}, {-20, 20, 0});
  build.quad({-20, 2, 0}, {20, 2, 0}, {20, 2, 20}, {-20, 2, 20});
  const PinholeCamera camera = camera_at({0, -3, 2}, {0, 2, 1}, 48, 48, 1.5);
  const auto spread = [](const Image& image) {
    double sum = 0;
    for (int y = 0; y < 48; ++y)
      for (int x = 1; x < 48; ++x) sum += std::abs(image.pixel(x, y)[0] - image.pixel(x - 1, y)[0]);
    return sum / (48 * 47);
  };
  studio.options.smoothing = 0;
  const Image grainy = studio.picture(camera, uniform_sky(1), 0.5f).rgb;
  studio.options.smoothing = 3;
  const Image smooth = studio.picture(camera, uniform_sky(1), 0.5f).rgb;
  EXPECT_LT(spread(smooth), 0.25 * spread(grainy));
  EXPECT_NEAR(mean(smooth) / mean(grainy), 1, 0.01);
}

TEST(PathRenderer, WhatPassesIsSeenButIsNoTruth) {
  TriangleMesh lasting, passing;
  MeshBuilder(lasting).quad({-9, 0, -9}, {9, 0, -9}, {9, 0, 9}, {-9, 0, 9});
  MeshBuilder(passing).box({-0.5f, -2, -0.5f}, {0.5f, -1.5f, 0.5f});
  const RayScene all(lasting, passing), scene(lasting);
  const std::vector<Texture> materials = flat(0.5f);
  const Environment sky = uniform_sky(1);
  const PathRenderer renderer(all, scene, materials, sky, {});
  const Picture picture = renderer.render(camera_at({0, -6, 0}, {0, 0, 0}, 25, 25, 1), 0, RunContext(1));
  EXPECT_EQ(picture.transient.at(12, 12), 255);
  EXPECT_EQ(picture.transient.at(0, 0), 0);
  EXPECT_NEAR(*picture.depth.pixel(12, 12), 6, 1e-5);
}

}  // namespace
}  // namespace roxel

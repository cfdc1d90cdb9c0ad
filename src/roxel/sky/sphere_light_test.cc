#include "roxel/sky/sphere_light.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "roxel/sky/sky_fixture.h"
#include "roxel/sky/sun_search.h"

namespace roxel {
namespace {

constexpr double kSphere = 4 * std::numbers::pi;

PinholeCamera camera(int width = 60, int height = 40, double focal = 50) {
  PinholeCamera camera;
  camera.intrinsics = {width, height, focal, focal, width / 2.0, height / 2.0, 0};
  // Looks north and up.
  camera.pose.rotation << 1, 0, 0, 0, 0.6, -0.8, 0, 0.8, 0.6;
  return camera;
}

TEST(FacetSphere, CoversTheSphereOnce) {
  for (const int level : {0, 2, 4}) {
    const FacetSphere sphere(level);
    EXPECT_EQ(sphere.count(), 8 << (2 * level));
    double area = 0;
    for (int f = 0; f < sphere.count(); ++f) area += sphere.solid_angle(f);
    EXPECT_NEAR(area, kSphere, 1e-9);
  }
}

TEST(FacetSphere, FindsTheFacetThatHoldsADirection) {
  const FacetSphere sphere(5);
  std::mt19937 random(3);
  std::normal_distribution<> normal;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d d(normal(random), normal(random), normal(random));
    EXPECT_TRUE(sphere.contains(sphere.facet_at(d), d));
  }
  for (int f = 0; f < sphere.count(); f += 7) EXPECT_EQ(sphere.facet_at(sphere.centre(f)), f);
}

TEST(FacetSphere, NeighboursShareAnEdge) {
  const FacetSphere sphere(3);
  for (int f = 0; f < sphere.count(); ++f)
    for (const int n : sphere.neighbours(f)) {
      const auto& back = sphere.neighbours(n);
      EXPECT_EQ(std::count(back.begin(), back.end(), f), 1);
    }
}

TEST(FacetSphere, HasFacetsOfOneToThreeDegreesAtTheDefaultLevel) {
  const FacetSphere sphere(SkyFitOptions{}.facet_level);
  for (int f = 0; f < sphere.count(); f += 11) {
    const auto& c = sphere.corners(f);
    for (int e = 0; e < 3; ++e) {
      const double edge = std::acos(c[e].dot(c[(e + 1) % 3])) / kDegree;
      EXPECT_GT(edge, 1);
      EXPECT_LT(edge, 3);
    }
  }
}

TEST(PixelRays, SolidAnglesOfAPanoramaAreTheSphere) {
  const PixelRays rays(Equirectangular{36, 18});
  double area = 0;
  for (int y = 0; y < 18; ++y) area += 36 * rays.solid_angle(5, y);
  EXPECT_NEAR(area, kSphere, 1e-9);
}

TEST(PixelRays, SolidAnglesOfAPinholePictureAreThatOfItsPyramid) {
  const PinholeCamera c = camera();
  const PixelRays rays(c, Eigen::Matrix3d::Identity());
  double area = 0;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 60; ++x) area += rays.solid_angle(x, y);
  // Of a pyramid of half angles a, b: 4 asin(sin a sin b).
  const double a = std::atan(0.6), b = std::atan(0.4);
  EXPECT_NEAR(area, 4 * std::asin(std::sin(a) * std::sin(b)), 1e-9);
}

TEST(PixelRays, PositionIsTheInverseOfDirection) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (const PixelRays& rays : {PixelRays(camera(), turn), PixelRays(Equirectangular{200, 100})}) {
    const auto at = rays.position(rays.direction(13.25, 7.5));
    ASSERT_TRUE(at);
    EXPECT_LT((*at - Eigen::Vector2d(13.25, 7.5)).norm(), 1e-9);
  }
  EXPECT_FALSE(PixelRays(camera(), turn).position(-PixelRays(camera(), turn).direction(30, 20)));
}

TEST(PixelRays, PanoramasHaveNorthInTheMiddleAndEastToTheRight) {
  const Equirectangular frame{400, 200};
  EXPECT_LT((frame.direction(200, 100) - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_LT((frame.direction(300, 100) - Eigen::Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((frame.direction(123, 0) - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
}

TEST(ClipLevel, IsJustBelowWhiteForDisplayedAndTheTopOfRadianceForOthers) {
  Image image(4, 4, 3, 0.3f);
  image.pixel(1, 1)[0] = 1.0f;
  EXPECT_NEAR(clip_level(image), 0.985, 1e-9);
  image.pixel(1, 1)[0] = 800;
  EXPECT_GT(clip_level(image), 60000);
  for (int x = 0; x < 4; ++x) image.pixel(x, 2)[1] = 900;
  EXPECT_NEAR(clip_level(image), 899.1, 0.01);
}

SphereLight light_of(const std::vector<SkyPicture>& pictures, int level = 3) {
  SphereLightSum sum(FacetSphere::of_level(level));
  for (const SkyPicture& picture : pictures) sum.add(picture);
  return sum.result();
}

SkyPicture plain(float value) {
  return {Image(60, 40, 3, value), {}, {}, PixelRays(camera(), Eigen::Matrix3d::Identity())};
}

TEST(SphereLight, OfOneColourHasThatMeanAndNoVariance) {
  const SphereLight light = light_of({plain(0.7f)});
  double weight = 0;
  for (const FacetLight& facet : light.facets) {
    weight += facet.weight;
    if (!(facet.weight > 0)) continue;
    EXPECT_NEAR(facet.mean[1], 0.7, 1e-6);
    EXPECT_NEAR(facet.contrast, 0, 1e-3);
    EXPECT_LE(facet.coverage, 1 + 1e-9);
  }
  EXPECT_NEAR(weight, 4 * std::asin(std::sin(std::atan(0.6)) * std::sin(std::atan(0.4))), 1e-9);
}

TEST(SphereLight, FacetsInsideThePictureAreCoveredWhole) {
  const SphereLight light = light_of({plain(1)});
  const int inside =
      light.sphere->facet_at(PixelRays(camera(), Eigen::Matrix3d::Identity()).direction(30, 20));
  EXPECT_NEAR(light.facets[inside].coverage, 1, 0.05);
}

TEST(SphereLight, AveragesPicturesAndReportsTheirDisagreement) {
  const SphereLight light = light_of({plain(1), plain(3)});
  const int inside =
      light.sphere->facet_at(PixelRays(camera(), Eigen::Matrix3d::Identity()).direction(30, 20));
  EXPECT_EQ(light.facets[inside].pictures, 2);
  EXPECT_NEAR(light.facets[inside].mean[0], 2, 1e-9);
  EXPECT_NEAR(light.facets[inside].disagreement, 0.5, 1e-9);
  EXPECT_NEAR(light.facets[inside].variance[0], 1, 1e-9);
}

TEST(SphereLight, LeavesClippedPixelsOutOfMeans) {
  SkyPicture picture = plain(0.5f);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 30; ++x) picture.rgb.pixel(x, y)[2] = 1;
  picture.clip = 0.985;
  const SphereLight light = light_of({picture}, 2);
  double clipped = 0, weight = 0;
  for (const FacetLight& facet : light.facets) {
    clipped += facet.clipped, weight += facet.weight;
    if (facet.weight > 0) {
      EXPECT_NEAR(facet.mean[2], 0.5, 1e-6);
    }
  }
  EXPECT_NEAR(clipped, weight, 1e-9);
}

TEST(FindSun, IsTheBrightestClusterToAPixel) {
  for (const double elevation : {15.0, 40.0, 75.0}) {
    const NodeSky sky = clear_sky(222, elevation);
    const auto found = find_sun(light_of({panorama_of(sky, {})}, 5));
    ASSERT_TRUE(found);
    EXPECT_GT(found->direction.dot(sky.sun), std::cos(1 * kDegree)) << "a pixel";
    EXPECT_FALSE(found->clipped);
  }
}

TEST(FindSun, FindsNoneUnderCloud) { EXPECT_FALSE(find_sun(light_of({panorama_of(overcast_sky(), {})}, 5))); }

TEST(FindSun, TakesTheMiddleOfASmallClippedPatch) {
  SkyPicture picture = panorama_of(clear_sky(100, 35), {});
  // The glare is four degrees across.
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 360; ++x) {
      const double apart = picture.rays.direction(x + 0.5, y + 0.5).dot(clear_sky(100, 35).sun);
      for (int c = 0; c < 3; ++c) {
        float& value = picture.rgb.pixel(x, y)[c];
        value = apart > std::cos(4 * kDegree) ? 1.0f : std::min(0.9f, value);
      }
    }
  picture.clip = clip_level(picture.rgb);
  const auto found = find_sun(light_of({picture}, 5));
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->clipped);
  EXPECT_GT(found->direction.dot(clear_sky(100, 35).sun), std::cos(2 * kDegree));
}

TEST(MeasureSun, SumsTheDiscWithoutTheSkyAroundIt) {
  const NodeSky sky = clear_sky();
  const SunMeasure measured = measure_sun(panorama_of(sky, {}), sky.sun);
  ASSERT_TRUE(measured.in_view);
  EXPECT_TRUE(measured.shines);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(measured.irradiance[c] / sky.sun_irradiance[c], 1, 0.02);
}

TEST(MeasureSun, SaysWhereItIsHidden) {
  NodeSky sky = clear_sky(150, 10);
  Square square;
  square.roof_deg = 30;
  const SunMeasure measured = measure_sun(panorama_of(sky, square), sky.sun);
  EXPECT_TRUE(measured.in_view);
  EXPECT_FALSE(measured.shines);
}

}  // namespace
}  // namespace roxel

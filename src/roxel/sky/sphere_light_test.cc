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

TEST(PixelRays, RangesHoldAllThatLooksNearADirection) {
  const Eigen::Matrix3d same = Eigen::Matrix3d::Identity();
  const PinholeCamera wide = camera(90, 60, 25);  // corners 65 degrees off
  for (const PixelRays& rays : {PixelRays(Equirectangular{120, 60}), PixelRays(wide, same)})
    for (const SunPosition at :
         {SunPosition{180, 40}, {179, 5}, {-179, 60}, {0, 89}, {30, -88}, {330, 70}, {40, 20}})
      for (const double angle : {0.03, 0.2}) {
        const Eigen::Vector3d d = sun_direction(at);
        const PixelRange range = rays.around(d, angle);
        EXPECT_LE(range.x1 - range.x0, rays.width());
        std::vector<bool> held(static_cast<std::size_t>(rays.width()) * rays.height());
        for (int y = range.y0; y < range.y1; ++y)
          for (int x = range.x0; x < range.x1; ++x)
            held[static_cast<std::size_t>(y) * rays.width() + (x + rays.width()) % rays.width()] = true;
        for (int y = 0; y < rays.height(); ++y)
          for (int x = 0; x < rays.width(); ++x)
            if (rays.direction(x + 0.5, y + 0.5).dot(d) > std::cos(angle)) {
              EXPECT_TRUE(held[static_cast<std::size_t>(y) * rays.width() + x])
                  << at.azimuth_deg << " " << x << " " << y;
            }
      }
}

TEST(ClipLevel, IsJustBelowWhiteForDisplayedAndTheTopOfRadianceForOthers) {
  Image image(4, 4, 3, 0.3f);
  image.pixel(1, 1)[0] = 1.0f;
  EXPECT_NEAR(clip_level(image), 0.985, 1e-9);
  image.pixel(1, 1)[0] = 800;
  EXPECT_EQ(clip_level(image), std::numeric_limits<double>::infinity());
  for (int x = 0; x < 4; ++x) image.pixel(x, 2)[1] = 900;
  EXPECT_NEAR(clip_level(image), 899.1, 0.01);
}

TEST(ClipLevel, IsTheEndOfHalfFloatsOnlyWhereTheyEnd) {
  Image image(4, 4, 3, 0.3f);
  image.pixel(1, 1)[0] = 65504;
  EXPECT_EQ(clip_level(image), 65000);
  for (const float peak : {65280.0f, 69120.0f, 80000.0f}) {  // of Radiance files
    image.pixel(1, 1)[0] = peak;
    EXPECT_EQ(clip_level(image), std::numeric_limits<double>::infinity()) << peak;
  }
}

TEST(ClipLevel, CountsPixelsNotChannels) {
  Image image(4, 4, 3, 0.3f);
  for (int x = 0; x < 3; ++x)  // a flat grey disc: nine values, three pixels
    for (int c = 0; c < 3; ++c) image.pixel(x, 1)[c] = 5000;
  EXPECT_EQ(clip_level(image), std::numeric_limits<double>::infinity());
  image.pixel(3, 1)[2] = 5000;
  EXPECT_NEAR(clip_level(image), 4995, 0.01);
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

/// Of a facet, by points of it, each with the solid angle of its part of the flat triangle.
double share_in_view(const std::array<Eigen::Vector3d, 3>& corners, const PixelRays& rays) {
  constexpr int kFine = 90;
  double in_view = 0, all = 0;
  const Eigen::Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  for (int i = 0; i < kFine; ++i)
    for (int j = 0; i + j < kFine; ++j) {
      const double a = (i + 1.0 / 3) / kFine, b = (j + 1.0 / 3) / kFine;
      const Eigen::Vector3d d = (1 - a - b) * corners[0] + a * corners[1] + b * corners[2];
      const double weight = std::abs(d.dot(normal)) / std::pow(d.norm(), 3);
      const auto at = rays.position(d);
      all += weight;
      if (at && at->x() > 0 && at->x() < 60 && at->y() > 0 && at->y() < 40) in_view += weight;
    }
  return in_view / all;
}

TEST(SphereLight, FacetsInsideThePictureAreCoveredWholeAndAtItsBorderByTheirShare) {
  const PixelRays rays(camera(), Eigen::Matrix3d::Identity());
  for (const int level : {2, 3, 5}) {  // of pixels that are small and large beside facets
    const SphereLight light = light_of({plain(1)}, level);
    int whole = 0, border = 0;
    for (int f = 0; f < light.sphere->count(); ++f) {
      const auto& corners = light.sphere->corners(f);
      const auto in_view = std::count_if(corners.begin(), corners.end(), [&](const Eigen::Vector3d& corner) {
        const auto at = rays.position(corner);
        return at && at->x() > 0 && at->x() < 60 && at->y() > 0 && at->y() < 40;
      });
      if (in_view == 3) {
        EXPECT_NEAR(light.facets[f].coverage, 1, 1e-9) << f;
        ++whole;
      } else if (in_view > 0) {
        EXPECT_NEAR(light.facets[f].coverage, share_in_view(corners, rays), 0.02) << f;
        ++border;
      }
    }
    EXPECT_GE(whole, 2) << level;
    EXPECT_GT(border, 4) << level;
  }
}

TEST(FacetParts, OfAPatchAreWhatFinePointsOfItSay) {
  const FacetSphere sphere(4);
  FacetParts parts(sphere);
  const PixelRays rays(camera(12, 8, 10), Eigen::Matrix3d::Identity());  // pixels of some facets each
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 12; ++x) {
      const auto& found = parts.divide({rays.direction(x, y), rays.direction(x + 1, y),
                                        rays.direction(x + 1, y + 1), rays.direction(x, y + 1)});
      std::vector<double> share(sphere.count());
      double sum = 0;
      for (const FacetPart& part : found) {
        EXPECT_TRUE(sphere.contains(part.facet, part.middle));
        EXPECT_EQ(share[part.facet], 0) << "twice";
        share[part.facet] = part.share, sum += part.share;
      }
      EXPECT_NEAR(sum, 1, 1e-12);
      // Points of equal area in the picture, each by its own solid angle.
      constexpr int kFine = 60;
      std::vector<double> points(sphere.count());
      double all = 0;
      for (int j = 0; j < kFine; ++j)
        for (int i = 0; i < kFine; ++i) {
          const double u = x + (i + 0.5) / kFine, v = y + (j + 0.5) / kFine;
          const double weight = std::pow(1 + std::pow((u - 6) / 10, 2) + std::pow((v - 4) / 10, 2), -1.5);
          points[sphere.facet_at(rays.direction(u, v))] += weight, all += weight;
        }
      for (int f = 0; f < sphere.count(); ++f) ASSERT_NEAR(share[f], points[f] / all, 0.01) << f;
    }
}

TEST(FacetParts, OfAPatchThatTouchesEdgesAndCornersAreWhole) {
  const FacetSphere sphere(2);
  FacetParts parts(sphere);
  const double s = std::sin(0.1), c = std::cos(0.1);
  // Around the pole, where four facets meet, and with edges along theirs.
  for (const std::array<Eigen::Vector3d, 4>& patch :
       {std::array<Eigen::Vector3d, 4>{Eigen::Vector3d(s, 0, c), {0, s, c}, {-s, 0, c}, {0, -s, c}},
        std::array<Eigen::Vector3d, 4>{
            Eigen::Vector3d(0, 0, 1), {s, 0, c}, Eigen::Vector3d(s, s, c).normalized(), {0, s, c}}}) {
    double sum = 0;
    for (const FacetPart& part : parts.divide(patch)) sum += part.share;
    EXPECT_NEAR(sum, 1, 1e-12);
  }
  EXPECT_EQ(parts.divide({Eigen::Vector3d(s, 0, c), {0, s, c}, {-s, 0, c}, {0, -s, c}}).size(), 4u);
  const Eigen::Vector3d point = Eigen::Vector3d(1, 2, 3).normalized();
  ASSERT_EQ(parts.divide({point, point, point, point}).size(), 1u);  // of no area
  EXPECT_EQ(parts.divide({point, point, point, point})[0].share, 1);
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

TEST(SphereLight, HasThePeakOfAPixelThatIsMuchLargerThanFacets) {
  SkyPicture picture{Image(12, 8, 3, 1), {}, {}, PixelRays(camera(12, 8, 10), Eigen::Matrix3d::Identity())};
  for (int c = 0; c < 3; ++c) picture.rgb.pixel(6, 4)[c] = 50;
  const SphereLight light = light_of({picture}, 7);
  int inside = 0, touching = 0;
  for (const FacetLight& facet : light.facets) {
    if (facet.mean[1] > 49.9) {
      EXPECT_NEAR(facet.peak, 50, 1e-4);
      ++inside;
    } else if (facet.mean[1] > 1.001 && facet.mean[1] < 4) {  // of a fourteenth of it
      EXPECT_NEAR(facet.peak, 1, 1e-4);
      ++touching;
    }
  }
  EXPECT_GT(inside, 10);
  EXPECT_GT(touching, 0);
}

TEST(SphereLight, CountsAPixelOnceHoweverFineFacetsAre) {
  for (const int level : {2, 5}) {
    double pixels = 0;
    for (const FacetLight& facet : light_of({plain(1)}, level).facets) pixels += facet.pixels;
    EXPECT_NEAR(pixels, 60 * 40, 1e-6) << level;
  }
}

TEST(SphereLight, KnowsWhatMasksByHandSayWhereOnlySomePicturesHaveOne) {
  SkyPicture sky = plain(1);
  sky.known_sky = Mask(60, 40, 255);
  const SphereLight light = light_of({plain(1), sky, plain(1)});
  EXPECT_EQ(light.pictures, 3);
  EXPECT_EQ(light.masked_by_hand, 1);
  EXPECT_TRUE(is_known_sky(light.facets[light.sphere->facet_at(sky.rays.direction(30, 20))]));
  sky.known_sky = Mask(60, 40, 0);
  const SphereLight none = light_of({plain(1), sky});
  EXPECT_FALSE(is_known_sky(none.facets[none.sphere->facet_at(sky.rays.direction(30, 20))]));
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
    if (facet.clipped > 0) {
      EXPECT_EQ(facet.clip, 0.985);
      EXPECT_LT((facet.clipped_mean - Eigen::Vector3d(0.5, 0.5, 1)).norm(), 1e-6);
    }
    if (facet.weight > 0) {
      EXPECT_NEAR(facet.mean[2], 0.5, 1e-6);
    }
  }
  EXPECT_NEAR(clipped, weight, 1e-9);
}

TEST(BrightSpots, AreTheBrightestClusterToAPixel) {
  for (const double elevation : {15.0, 40.0, 75.0}) {
    const NodeSky sky = clear_sky(222, elevation);
    const auto found = bright_spots(light_of({panorama_of(sky, {})}, 5));
    ASSERT_EQ(found.size(), 1u);
    EXPECT_GT(found[0].direction.dot(sky.sun), std::cos(1 * kDegree)) << "a pixel";
    EXPECT_FALSE(found[0].clipped);
  }
}

TEST(BrightSpots, AreNoneUnderCloud) {
  EXPECT_TRUE(bright_spots(light_of({panorama_of(overcast_sky(), {})}, 5)).empty());
}

TEST(BrightSpots, TakeTheMiddleOfASmallClippedPatch) {
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
  const auto found = bright_spots(light_of({picture}, 5));
  ASSERT_FALSE(found.empty());
  EXPECT_TRUE(found[0].clipped);
  EXPECT_GT(found[0].direction.dot(clear_sky(100, 35).sun), std::cos(2 * kDegree));
}

/// A sphere of sky that is 1 + glow at `at`, falls off by e in 10 degrees, and is seen where `seen` says so.
template <class Seen>
SphereLight glowing(const Eigen::Vector3d& at, double glow, const Seen& seen) {
  SphereLight light{FacetSphere::of_level(5), {}, 1, 0};
  for (int f = 0; f < light.sphere->count(); ++f) {
    FacetLight facet;
    const double apart = std::acos(std::clamp(light.sphere->centre(f).dot(at), -1.0, 1.0)) / kDegree;
    if (seen(light.sphere->centre(f)))
      facet.coverage = 1, facet.weight = 1,
      facet.mean = Eigen::Vector3d::Constant(1 + glow * std::exp(-apart / 10));
    light.facets.push_back(facet);
  }
  return light;
}

TEST(Glares, TakesSkyAllAroundThatIsBrighterBesideTheSpot) {
  const Eigen::Vector3d at = sun_direction({120, 35});
  const FoundSun spot{at, 10, 1, true, 3};
  const auto all = [](const Eigen::Vector3d&) { return true; };
  const auto sky_where = [&](const auto& is_sky) {
    const SphereLight light = glowing(at, 5, all);
    std::vector<std::uint8_t> sky;
    for (int f = 0; f < light.sphere->count(); ++f) sky.push_back(is_sky(light.sphere->centre(f)));
    return sky;
  };
  const auto sky = sky_where([](const Eigen::Vector3d& d) { return d.z() > 0; });
  EXPECT_TRUE(glares(glowing(at, 5, all), sky, spot));
  EXPECT_FALSE(glares(glowing(at, 0.5, all), sky, spot)) << "hardly brighter";
  const auto right = [&](const Eigen::Vector3d& d) { return d.cross(at).z() < 0.02; };
  EXPECT_FALSE(glares(glowing(at, 5, right), sky, spot)) << "the picture ends beside it";
  EXPECT_TRUE(glares(glowing(at, 5, all), sky_where(right), spot)) << "a house hides half";
  EXPECT_FALSE(glares(glowing(at, 5, all),
                      sky_where([&](const Eigen::Vector3d& d) { return d.z() > at.z() + 0.06; }), spot))
      << "a wall below the sky";
}

TEST(MeasureSun, SumsTheDiscWithoutTheSkyAroundIt) {
  const NodeSky sky = clear_sky();
  const SunMeasure measured = measure_sun(panorama_of(sky, {}), sky.sun);
  ASSERT_TRUE(measured.in_view);
  EXPECT_TRUE(measured.shines);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(measured.irradiance[c] / sky.sun_irradiance[c], 1, 0.02);
}

TEST(MeasureSun, IsTheSameAtTheSeamAndNearTheZenith) {
  for (const SunPosition at :
       {SunPosition{180, 40}, {179, 40}, {181, 40}, {0, 40}, {150, 75}, {150, 85}, {180, 85}, {20, 89.5}}) {
    const NodeSky sky = clear_sky(at.azimuth_deg, at.elevation_deg);
    const SunMeasure measured = measure_sun(panorama_of(sky, {}), sky.sun);
    ASSERT_TRUE(measured.in_view) << at.azimuth_deg << " " << at.elevation_deg;
    EXPECT_TRUE(measured.shines && !measured.clipped);
    EXPECT_NEAR(measured.irradiance[1] / sky.sun_irradiance[1], 1, 0.03)
        << at.azimuth_deg << " " << at.elevation_deg;
  }
}

TEST(MeasureSun, TakesAPeakBeyondHalfFloatsAsItIs) {
  NodeSky sky = clear_sky();
  sky.sun_irradiance *= 80;  // a few pixels of a disc
  const SkyPicture picture = panorama_of(sky, {});
  const auto peak = std::max_element(picture.rgb.data().begin(), picture.rgb.data().end());
  SkyPicture brighter = picture;
  for (float& value : brighter.rgb.data()) value *= 80000 / *peak;
  brighter.clip = clip_level(brighter.rgb);
  const SunMeasure measured = measure_sun(brighter, sky.sun);
  EXPECT_FALSE(measured.clipped);
  EXPECT_NEAR(measured.irradiance[1] / (sky.sun_irradiance[1] * 80000 / *peak), 1, 0.03);
}

TEST(MeasureSun, SeesItInTheCornerOfAWidePicture) {
  const PinholeCamera wide = camera(300, 200, 90);
  SkyPicture picture{Image(300, 200, 3, 0.01f), {}, {}, PixelRays(wide, Eigen::Matrix3d::Identity())};
  const Eigen::Vector3d sun = picture.rays.direction(255, 40);  // 53 degrees off the axis
  for (int y = 30; y < 50; ++y)
    for (int x = 245; x < 265; ++x)
      if (picture.rays.direction(x + 0.5, y + 0.5).dot(sun) > std::cos(0.02))
        picture.rgb.pixel(x, y)[1] = 100;
  EXPECT_TRUE(measure_sun(picture, sun).in_view);
  EXPECT_TRUE(measure_sun(picture, sun).shines);
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

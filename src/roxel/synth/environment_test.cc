#include "roxel/synth/environment.h"
#include "roxel/base/angles.h"

#include <gtest/gtest.h>

#include <cmath>

#include "roxel/synth/sample_stream.h"
#include "roxel/synth/sky_sampler.h"

namespace roxel {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

Environment uniform(float radiance, const Sun& sun = {}) {
  return Environment([=](const Vector3f&) { return Vector3f::Constant(radiance); }, sun);
}

Sun sun_at(const Vector3f& direction) {
  Sun sun;
  sun.direction = direction.normalized();
  sun.irradiance = Vector3f(3, 2.5f, 2);
  return sun;
}

TEST(SkyMap, HasNorthInTheMiddleEastToTheRightAndTheZenithOnTop) {
  const Image map(512, 256, 3);
  EXPECT_LT((map_direction(map, 256, 128) - Vector3f(0, 1, 0)).norm(), 1e-6);
  EXPECT_LT((map_direction(map, 384, 128) - Vector3f(1, 0, 0)).norm(), 1e-6);
  EXPECT_LT((map_direction(map, 100, 0) - Vector3f(0, 0, 1)).norm(), 1e-6);
  for (const Vector2f& at : {Vector2f(10.5f, 20.5f), Vector2f(400, 200), Vector2f(256, 1)})
    EXPECT_LT((map_position(map, map_direction(map, at.x(), at.y())) - at).norm(), 2e-2f);
}

TEST(Environment, OfOneBrightnessGivesPiTimesItOnTheGround) {
  EXPECT_LT((uniform(2).sky_irradiance() - Vector3f::Constant(2 * kPiFloat)).norm(), 2e-3f);
  const Environment sunny = uniform(2, sun_at({3, 0, 4}));
  EXPECT_LT((sunny.total_irradiance() - sunny.sky_irradiance() - 0.8f * sunny.sun().irradiance).norm(),
            1e-5f);
}

TEST(Environment, TheDiscInTheMapCarriesTheSunsLight) {
  for (const Vector3f& direction :
       {Vector3f(1, 0.2f, 0.5f), Vector3f(0.01f, -0.02f, 1), Vector3f(0, -1, 0.3f)}) {
    const Environment sky = uniform(0.5f, sun_at(direction));
    const Image with = sky.map_with_disc(), &without = sky.map_without_disc();
    Vector3f sum = Vector3f::Zero();
    for (int y = 0; y < 256; ++y) {
      const float pixel =
          (2 * kPiFloat / 512) * (kPiFloat / 256) * std::cos((0.5f - (y + 0.5f) / 256) * kPiFloat);
      for (int x = 0; x < 512; ++x)
        for (int c = 0; c < 3; ++c) sum[c] += pixel * (with.pixel(x, y)[c] - without.pixel(x, y)[c]);
    }
    EXPECT_LT((sum - sky.sun().irradiance).norm(), 0.01f) << direction.transpose();
  }
}

TEST(Environment, ACameraSeesTheDiscOnlyWhereItIs) {
  const Environment sky = uniform(0.5f, sun_at({1, 1, 1}));
  const Vector3f to_sun = sky.sun().direction, aside = Vector3f(1, -1, 0).normalized();
  const float radius = sky.sun().angular_radius_rad;
  EXPECT_GT(sky.seen(to_sun).x(), 1e4f);
  EXPECT_GT(sky.seen((to_sun + 0.9f * radius * aside).normalized()).x(), 1e4f);
  EXPECT_LT(sky.seen((to_sun + 1.1f * radius * aside).normalized()).x(), 1);
  EXPECT_LT(sky.seen(-to_sun).x(), 1);
  EXPECT_LT(sky.sky(to_sun).x(), 1);
}

/// Bright about one direction, dark below the horizon.
Environment spotted() {
  const Vector3f spot = Vector3f(-1, 0.4f, 0.6f).normalized();
  return Environment(
      [=](const Vector3f& d) {
        return Vector3f(
            Vector3f::Constant(d.z() < 0 ? 0.01f : 0.3f + 20 * std::pow(std::max(d.dot(spot), 0.0f), 60.0f)));
      },
      {});
}

TEST(SkySampler, ItsDensityIsThatOfItsDirections) {
  const SkySampler sampler(spotted());
  EXPECT_GT(sampler.peak(), 8);
  EXPECT_LT(SkySampler(uniform(1)).peak(), 1.1f);
  // 1 / density over the directions is the sphere's solid angle; the horizon's halves are its two halves.
  SampleStream random(1, 2, 3, 4);
  constexpr int kCount = 200000;
  double upper = 0, lower = 0;
  for (int i = 0; i < kCount; ++i) {
    const Vector3f d = sampler.direction(random.pair());
    ASSERT_NEAR(d.norm(), 1, 1e-5);
    (d.z() > 0 ? upper : lower) += 1 / sampler.density(d) / kCount;
  }
  EXPECT_NEAR(upper / (2 * kPiFloat), 1, 0.03);
  EXPECT_NEAR(lower / (2 * kPiFloat), 1, 0.1);  // few directions go there
}

TEST(SkySampler, FindsTheLightOfTheMap) {
  const Environment sky = spotted();
  const SkySampler sampler(sky);
  SampleStream random(5, 6, 7, 8);
  constexpr int kCount = 20000;
  double sum = 0;
  for (int i = 0; i < kCount; ++i) {
    const Vector3f d = sampler.direction(random.pair());
    sum += std::max(d.z(), 0.0f) * sky.sky(d).x() / sampler.density(d) / kCount;
  }
  EXPECT_NEAR(sum / sky.sky_irradiance().x(), 1, 0.01);
}

}  // namespace
}  // namespace roxel

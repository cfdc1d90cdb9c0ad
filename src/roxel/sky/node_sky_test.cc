#include "roxel/sky/node_sky.h"
#include "roxel/base/angles.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "roxel/sky/sky_fixture.h"

namespace roxel {
namespace {

constexpr double kQuadrature = 2e-3;  ///< 4096 directions

NodeSky uniform_sky() {
  NodeSky sky;
  sky.model = SkyModel::kUniform;
  for (int c = 0; c < 3; ++c) sky.channels[c] = {{0, -1, 0, -1, 0, 1}, 0.5 + c};
  return sky;
}

TEST(SkyLight, OfAUniformSkyIsPiTimesItsRadiance) {
  const SkyLight light(uniform_sky());
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(light.horizontal_irradiance(Disc::kWith)[c], kPi * (0.5 + c), kQuadrature * 9);
    EXPECT_NEAR(light.irradiance(Eigen::Vector3d::UnitX(), Disc::kWith)[c], kPi * (0.5 + c) / 2,
                kQuadrature * 9);
    EXPECT_NEAR(light.irradiance(-Eigen::Vector3d::UnitZ(), Disc::kWith)[c], 0, kQuadrature);
    EXPECT_NEAR(light.canonical_light()[c], 0.5 + c, kQuadrature * 3);
    EXPECT_NEAR(light.mean_radiance()[c], 0.5 + c, 1e-9);
  }
}

TEST(SkyLight, OfCiesOvercastSkyIsSevenNinthsOfItsZenith) {
  // Radiance (1 + 2 sin el) / 3 of the zenith's; [MoonSpencer42]. Perez's form of it is close.
  const NodeSky sky = overcast_sky();
  const double zenith = sky.radiance_in_sky(Eigen::Vector3d::UnitZ())[1];
  EXPECT_NEAR(SkyLight(sky).canonical_light()[1] / zenith, 7.0 / 9, 0.02);
}

TEST(SkyLight, TheDiscAddsItsCosine) {
  const NodeSky sky = clear_sky(90, 30);
  const SkyLight light(sky);
  const Eigen::Vector3d up =
      light.horizontal_irradiance(Disc::kWith) - light.horizontal_irradiance(Disc::kWithout);
  EXPECT_LT((up - 0.5 * sky.sun_irradiance).norm(), 1e-9);
  const Eigen::Vector3d west(-1, 0, 0), east(1, 0, 0);
  EXPECT_LT((light.irradiance(west, Disc::kWith) - light.irradiance(west, Disc::kWithout)).norm(), 1e-12);
  EXPECT_NEAR((light.irradiance(east, Disc::kWith) - light.irradiance(east, Disc::kWithout))[0],
              std::cos(30 * kDegree) * 3.3, 1e-9);
}

TEST(SkyLight, ASunThatDoesNotShineAddsNothing) {
  NodeSky sky = clear_sky();
  sky.sun_light = SunLight::kNone;
  const SkyLight light(sky);
  EXPECT_EQ(light.horizontal_irradiance(Disc::kWith), light.horizontal_irradiance(Disc::kWithout));
}

TEST(NodeSky, TurnsWithItsFrame) {
  NodeSky sky = clear_sky();
  const Eigen::Vector3d d = Eigen::Vector3d(0.3, -0.5, 0.6).normalized();
  const Eigen::Vector3d before = sky.radiance(d), lit = SkyLight(sky).irradiance(d, Disc::kWith);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  sky.sky_from_world = turn;
  EXPECT_LT((sky.radiance(turn.transpose() * d) - before).norm(), 1e-9);
  EXPECT_LT((SkyLight(sky).irradiance(turn.transpose() * d, Disc::kWith) - lit).norm(), 1e-9);
}

TEST(NodeSky, IsDarkBelowTheHorizonAndWithoutAModel) {
  NodeSky sky = clear_sky();
  EXPECT_EQ(sky.radiance({0.6, 0, -0.8}), Eigen::Vector3d::Zero());
  EXPECT_GT(sky.radiance({0.6, 0, 0.8}).minCoeff(), 0);
  sky.model = SkyModel::kNone;
  EXPECT_EQ(sky.radiance({0.6, 0, 0.8}), Eigen::Vector3d::Zero());
}

TEST(SkyMap, HoldsTheLightOfTheDisc) {
  const NodeSky sky = clear_sky();
  const Image with = sky_map(sky, Disc::kWith), without = sky_map(sky, Disc::kWithout);
  const PixelRays rays(Equirectangular{with.width(), with.height()});
  double light = 0;
  for (int y = 0; y < with.height(); ++y)
    for (int x = 0; x < with.width(); ++x)
      light += (with.pixel(x, y)[0] - without.pixel(x, y)[0]) * rays.solid_angle(x, y);
  EXPECT_NEAR(light, sky.sun_irradiance[0], 1e-3);
  EXPECT_EQ(without.pixel(7, 200)[1], 0);
}

TEST(SphericalFunctions, AreOrthonormal) {
  const FacetSphere sphere(5);
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(25, 25);
  for (int f = 0; f < sphere.count(); ++f) {
    const std::vector<double> y = spherical_functions(4, sphere.centre(f));
    const Eigen::Map<const Eigen::VectorXd> v(y.data(), 25);
    gram += sphere.solid_angle(f) * v * v.transpose();
  }
  EXPECT_LT((gram - Eigen::MatrixXd::Identity(25, 25)).cwiseAbs().maxCoeff(), 0.01);
}

}  // namespace
}  // namespace roxel

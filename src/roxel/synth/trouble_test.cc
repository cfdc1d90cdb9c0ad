/// Noise of sensors and poses, and things that pass.

#include <gtest/gtest.h>

#include <cmath>

#include "roxel/synth/camera_paths.h"
#include "roxel/synth/pose_noise.h"
#include "roxel/synth/sensor_noise.h"
#include "roxel/synth/transients.h"

namespace roxel {
namespace {

using Eigen::Vector3d;

struct Moments {
  double mean = 0, deviation = 0;
};

Moments noisy(float value, double sigma, std::uint32_t seed = 1) {
  Image image(120, 100, 3, value);
  add_sensor_noise(image, sigma, 0, seed);
  double sum = 0, squares = 0;
  for (float v : image.data()) sum += v, squares += static_cast<double>(v) * v;
  const double n = static_cast<double>(image.data().size());
  return {sum / n, std::sqrt(squares / n - sum * sum / (n * n))};
}

TEST(SensorNoise, GrowsWithTheRootOfLightAndKeepsItsMean) {
  for (const float value : {0.04f, 0.25f, 1.0f}) {
    const Moments found = noisy(value, 0.02);
    const double expected = 0.02 * std::sqrt(value), quantum = 1 / 4096.0 / std::sqrt(12);
    EXPECT_NEAR(found.mean, value, 4 * expected / std::sqrt(36000)) << value;
    EXPECT_NEAR(found.deviation / std::hypot(expected, quantum), 1, 0.02) << value;
  }
}

TEST(SensorNoise, FewPhotonsArePoissonDistributed) {
  // 100 photons at white: at 0.03 there are three, and in exp(-3) of all pixels none.
  Image image(200, 100, 1, 0.03f);
  add_sensor_noise(image, 0.1, 0, 1);
  double none = 0;
  for (float v : image.data()) none += v == 0;
  EXPECT_NEAR(none / 20000, std::exp(-3), 0.006);
}

TEST(SensorNoise, StepsDoubleAboveWhite) {
  Image image(50, 50, 1, 5.3f);
  add_sensor_noise(image, 0.001, 0, 1);
  for (float v : image.data()) EXPECT_EQ(v * 512, std::round(v * 512));  // 8 / 4096
  Image dim(50, 50, 1, 0.3f);
  add_sensor_noise(dim, 0.001, 0, 1);
  int odd = 0;
  for (float v : dim.data()) {
    EXPECT_EQ(v * 4096, std::round(v * 4096));
    odd += std::fmod(std::round(v * 4096), 8) != 0;
  }
  EXPECT_GT(odd, 1000);
}

TEST(SensorNoise, IsNoneAtZeroAndAnotherForAnotherSeedOrImage) {
  const auto made = [](double sigma, int image_idx, std::uint32_t seed) {
    Image image(8, 8, 3, 0.3333f);
    add_sensor_noise(image, sigma, image_idx, seed);
    return image.data();
  };
  EXPECT_EQ(made(0, 0, 1), std::vector<float>(192, 0.3333f));
  EXPECT_EQ(made(0.05, 0, 1), made(0.05, 0, 1));
  EXPECT_NE(made(0.05, 0, 1), made(0.05, 1, 1));
  EXPECT_NE(made(0.05, 0, 1), made(0.05, 0, 2));
}

std::vector<PinholeCamera> cameras(int count, bool one_centre) {
  std::vector<PinholeCamera> all;
  for (int i = 0; i < count; ++i)
    all.push_back(
        {simple_intrinsics(64, 48, 1),
         looking_at(one_centre ? Vector3d(1, 2, 3) : Vector3d(i, 0.5 * i, 3), Vector3d(0, 5 + i, 0))});
  return all;
}

TEST(PoseNoise, HasTheDeviationsThatAreAskedFor) {
  constexpr int kCount = 1500;
  const auto before = cameras(kCount, false), after = with_pose_noise(before, {0.5, 0.02}, 3);
  double angles = 0, shifts = 0;
  for (int i = 0; i < kCount; ++i) {
    const Eigen::Matrix3d turn = after[i].pose.rotation * before[i].pose.rotation.transpose();
    EXPECT_NEAR(turn.determinant(), 1, 1e-9);
    const double angle = std::acos(std::min(1.0, 0.5 * (turn.trace() - 1))) * 180 / M_PI;
    angles += angle * angle;
    shifts += (after[i].pose.centre - before[i].pose.centre).squaredNorm();
    EXPECT_EQ(after[i].intrinsics, before[i].intrinsics);
  }
  EXPECT_NEAR(std::sqrt(angles / (3 * kCount)) / 0.5, 1, 0.04);
  EXPECT_NEAR(std::sqrt(shifts / (3 * kCount)) / 0.02, 1, 0.04);
}

TEST(PoseNoise, KeepsANodeTogether) {
  const auto before = cameras(5, true), after = with_pose_noise(before, {1, 0.1}, 3);
  for (int i = 1; i < 5; ++i) {
    EXPECT_EQ(after[i].pose.centre, after[0].pose.centre);
    const Eigen::Matrix3d was = before[i].pose.rotation * before[0].pose.rotation.transpose();
    const Eigen::Matrix3d is = after[i].pose.rotation * after[0].pose.rotation.transpose();
    EXPECT_LT((was - is).norm(), 1e-9);
  }
  EXPECT_GT((after[0].pose.centre - before[0].pose.centre).norm(), 0.01);
}

TEST(Transients, ArePaintedThingsOfTheirOccasionOnTheStage) {
  for (const WorldKind kind : {WorldKind::kPlane, WorldKind::kHead, WorldKind::kMug, WorldKind::kTable,
                               WorldKind::kStreet, WorldKind::kFlights}) {
    World world = make_world(kind, {3, 32, 24, 1});
    const std::size_t materials = world.materials.size();
    const TriangleMesh first = make_transients(world, 0, 4, 1);
    EXPECT_EQ(world.materials.size(), materials + 4);
    for (std::uint16_t material : first.materials) EXPECT_GE(material, materials);
    const TriangleMesh second = make_transients(world, 1, 4, 1);
    EXPECT_GT((first.bounds().min() - second.bounds().min()).norm(), 1e-3f);
    Eigen::AlignedBox3f stages;
    for (const auto& stage : world.stages) stages.extend(stage);
    const float room = 1.3f * world.transient_size;
    stages.min().array() -= room, stages.max().array() += room;
    EXPECT_TRUE(stages.contains(first.bounds()));
  }
}

}  // namespace
}  // namespace roxel

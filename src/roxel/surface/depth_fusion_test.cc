#include "roxel/surface/depth_fusion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "roxel/base/error.h"
#include "roxel/surface/surface_extraction.h"
#include "roxel/surface/surface_fixture.h"

namespace roxel {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

std::vector<FusionView> ball_views() {
  std::vector<FusionView> views;
  for (const PinholeCamera& camera : fixture::cameras_around()) views.push_back(fixture::ball_view(camera));
  return views;
}

DistanceField fused(const std::vector<FusionView>& views, const FusionOptions& options, int threads = 2) {
  RunContext context(threads);
  return fuse_depth(
      static_cast<int>(views.size()), [&](int v) { return views[v]; }, options, context);
}

/// A camera at the origin that sees a wall at that distance everywhere.
FusionView wall(float depth, float variance, int size = 32) {
  PinholeCamera camera;
  camera.intrinsics = {size, size, 1.25 * size, 1.25 * size, 0.5 * size, 0.5 * size, 0};
  return {
      camera, Image(size, size, 1, depth), Image(size, size, 1, variance), Image(size, size, 1, 1.0f), {}};
}

FusionOptions wall_options() {
  FusionOptions options;
  options.voxel_size = 0.1;
  options.box = {Vector3d(-0.5, -0.5, 1), Vector3d(0.5, 0.5, 4)};
  options.hole_size = 0;
  options.smooth = 0;
  return options;
}

TEST(DepthFusion, DistanceToABallIsThatOfTheBall) {
  const DistanceField field = fused(ball_views(), fixture::ball_fusion());
  int near = 0;
  for (double r = 0.92; r < 1.04; r += 0.01) {
    const Vector3d x = r * Vector3d(0.6, 0.64, 0.48);
    const auto sample = field.at(x);
    ASSERT_TRUE(sample);
    // The field answers at the nearest corner, at most half a step away along each axis.
    const Vector3d corner = ((x.array() + 1.5) / 0.08).round() * 0.08 - 1.5;
    EXPECT_NEAR(sample->distance, corner.norm() - 1, 0.03) << r;
    near += sample->views >= 2;
  }
  EXPECT_GT(near, 8);
}

TEST(DepthFusion, ViewsWeighByInverseVariance) {
  FusionOptions options = wall_options();
  options.least_sigma = 1e-3;
  // Variances 1 and 3: the surface is three times nearer to the surer one.
  const DistanceField field = fused({wall(2.0f, 0.01f), wall(2.1f, 0.03f)}, options);
  const auto sample = field.at({0, 0, 2.0});
  ASSERT_TRUE(sample);
  EXPECT_NEAR(sample->distance, 0.025, 1e-4);
  EXPECT_NEAR(sample->weight, 100 + 100.0 / 3, 2);  // the wall's normal is that of the middle pixels
}

TEST(DepthFusion, ViewsThatDifferAreLessSureThanTheySay) {
  const auto weight = [](float other) {
    return fused({wall(2.0f, 0.0025f), wall(other, 0.0025f)}, wall_options()).at({0, 0, 2.0})->weight;
  };
  EXPECT_NEAR(weight(2.02f), weight(2.0f), 0.01f * weight(2.0f));  // within their deviations of 0.05
  // 0.3 apart, deviations of 0.05 and half a step together: chi2 = 0.3^2 / 2 / 0.005.
  EXPECT_NEAR(weight(2.3f), weight(2.0f) / 9, 0.1f * weight(2.0f) / 9);
}

TEST(DepthFusion, RefusesVarianceThatIsNoNumber) {
  FusionView broken = wall(2.0f, 0.01f);
  for (float& v : broken.variance.data()) v = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(fused({broken}, wall_options()), InvalidInput);
}

TEST(DepthFusion, HiddenPlacesAreNotSpokenOf) {
  const DistanceField field = fused({wall(2.0f, 0.01f)}, wall_options());
  EXPECT_GT(field.at({0, 0, 1.8})->weight, 0);
  EXPECT_EQ(field.at({0, 0, 2.9}), std::nullopt);
  EXPECT_LT(field.at({0, 0, 2.2})->weight, field.at({0, 0, 2.0})->weight);
}

TEST(DepthFusion, EmptyRaysWeighAgainstASurface) {
  FusionView nothing = wall(0.0f, 0.0f);
  for (float& a : nothing.opacity.data()) a = 0;
  const FusionView seen = wall(2.0f, 0.5f);  // not sure at all
  const double alone = fused({seen}, wall_options()).at({0, 0, 2.1})->distance;
  const double against = fused({seen, nothing}, wall_options()).at({0, 0, 2.1})->distance;
  EXPECT_LT(alone, 0);
  EXPECT_GT(against, 0);
}

TEST(DepthFusion, IsTheSameForAnyNumberOfThreads) {
  const auto points_of = [](int threads) {
    FusionOptions fine = fixture::ball_fusion();
    fine.voxel_size /= 4;  // so that there is more than one block of points
    ExtractionOptions extraction;
    extraction.threads = threads;
    return extract_surface(fused(ball_views(), fine, threads), extraction).surface.mesh.points;
  };
  const auto one = points_of(1);
  EXPECT_GT(one.size(), std::size_t{1} << 14);
  EXPECT_EQ(one, points_of(2));
  EXPECT_EQ(one, points_of(4));
}

TEST(DepthFusion, NoDepthAndTooMuchOfItAreErrors) {
  try {
    fused({wall(0.0f, 0.0f)}, wall_options());
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_THAT(error.what(), HasSubstr("no view has depth"));
  }
  FusionOptions fine = wall_options();
  fine.most_bytes = 1000;
  try {
    fused({wall(2.0f, 0.01f)}, fine);
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_THAT(error.what(), HasSubstr("MiB"));
  }
}

TEST(DepthFusion, WhatHolesNeedCountsAsMemoryToo) {
  const auto least = [](double hole_size) {
    FusionOptions options = wall_options();
    options.hole_size = hole_size;
    for (options.most_bytes = 1 << 16;; options.most_bytes = options.most_bytes * 5 / 4) try {
        fused({wall(2.0f, 0.01f)}, options);
        return options.most_bytes;
      } catch (const InvalidInput&) {
      }
  };
  EXPECT_GT(least(60), 2 * least(0));
}

/// The least memory, to a sixteenth, in which `work` does not throw InvalidInput.
std::int64_t least_memory(const std::function<void(std::int64_t bytes)>& work) {
  const auto fits = [&](std::int64_t bytes) {
    try {
      work(bytes);
    } catch (const InvalidInput&) {
      return false;
    }
    return true;
  };
  std::int64_t too_little = 1 << 16, enough = too_little;
  while (!fits(enough *= 2)) too_little = enough;
  while (enough - too_little > enough / 16) {
    const std::int64_t middle = (enough + too_little) / 2;
    (fits(middle) ? enough : too_little) = middle;
  }
  return enough;
}

TEST(DepthFusion, ViewsCountAsMemoryTooAndHowManyAreHeldChangesNothing) {
  // The same wall, with four times the pixels.
  const auto least = [](int size) {
    FusionOptions options = wall_options();
    options.hole_size = 0;
    return least_memory([&](std::int64_t bytes) {
      options.most_bytes = bytes;
      fused({wall(2.0f, 0.01f, size), wall(2.0f, 0.01f, size)}, options);
    });
  };
  // Of each of two views on two threads 64 bytes a pixel while it is read, and 8 once it is ready.
  EXPECT_GT(least(512), least(256) + 2 * (512 * 512 - 256 * 256) * 70);

  std::vector<FusionView> views;
  for (const PinholeCamera& camera : fixture::cameras_around(8, 256))
    views.push_back(fixture::ball_view(camera));
  struct Outcome {
    std::vector<Vector3d> points;
    int loaded = 0;
  };
  const auto outcome = [&](const FusionOptions& options) {
    std::atomic<int> loaded{0};
    RunContext context(1);
    const auto load = [&](int v) { return ++loaded, views[v]; };
    const DistanceField field = fuse_depth(8, load, options, context);
    return Outcome{extract_surface(field, {}).surface.mesh.points, loaded};
  };
  const FusionOptions ample = fixture::ball_fusion();
  const Outcome expected = outcome(ample);
  EXPECT_EQ(expected.loaded, 8);  // they stay
  FusionOptions tight = ample;
  tight.most_bytes = least_memory([&](std::int64_t bytes) {
    tight.most_bytes = bytes;
    outcome(tight);
  });
  const Outcome found = outcome(tight);
  EXPECT_EQ(found.points, expected.points);
  EXPECT_EQ(found.loaded, 16);  // they are read twice
}

// Far off the axis directions are much longer than 1 a unit of depth: so is what turns depth into distance.
TEST(DepthFusion, WideLensesSeeTrueDistances) {
  FusionView wide = wall(2.0f, 0.01f, 64);
  wide.camera.intrinsics = {64, 64, 6, 6, 32, 32, 0};
  const PinholeCamera& camera = wide.camera;
  wide.normal = Image(64, 64, 3);  // all surfaces face the camera
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const Vector3d n = -camera.ray(x + 0.5, y + 0.5).direction.normalized();
      for (int c = 0; c < 3; ++c) wide.normal.pixel(x, y)[c] = static_cast<float>(n[c]);
    }
  FusionOptions options = wall_options();
  options.box = {Vector3d(-12, -12, 1), Vector3d(12, 12, 4)};
  options.band = 10;
  const DistanceField field = fused({wide}, options);
  int looked = 0;
  for (int x = 2; x < 64; x += 3) {
    const Ray ray = camera.ray(x + 0.5, 32.5);
    const double length = ray.direction.norm();
    const Vector3d corner = ((1.9 * ray.direction).array() / 0.1).round() * 0.1;
    const auto sample = field.at(corner);
    if (!sample || sample->weight <= 0) continue;
    ++looked;
    // The corner is up to half a step off the ray, along each axis.
    EXPECT_NEAR(sample->distance, std::min(0.1 * length, 1.0), 0.05 * length + 0.05) << length;
  }
  EXPECT_GT(looked, 15);
}

TEST(DepthFusion, CanBeCancelled) {
  RunContext context(1);
  context.cancel();
  EXPECT_THROW(fuse_depth(
                   1, [](int) { return wall(2.0f, 0.01f); }, wall_options(), context),
               Cancelled);
}

TEST(DepthFusion, SmoothingPullsAtNoise) {
  const auto roughness = [](double smooth) {
    std::vector<FusionView> views{wall(2.0f, 0.01f)};
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 32; ++x) *views[0].depth.pixel(x, y) += (x / 4 + y / 4) % 2 ? 0.04f : -0.04f;
    FusionOptions options = wall_options();
    options.smooth = smooth;
    const Surface surface = extract_surface(fused(views, options), {1, 0, 0}).surface;
    double sum = 0;
    for (const Vector3d& x : surface.mesh.points) sum += std::abs(x.z() - 2);
    return sum / static_cast<double>(surface.mesh.points.size());
  };
  EXPECT_LT(roughness(2), 0.7 * roughness(0));
}

}  // namespace
}  // namespace roxel

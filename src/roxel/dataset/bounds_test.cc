#include "roxel/dataset/bounds.h"

#include <gmock/gmock.h>

#include <random>

#include "roxel/base/error.h"
#include "roxel/dataset/box_visibility.h"
#include "roxel/dataset/camera_box.h"
#include "roxel/dataset/rig_fixture.h"

namespace roxel {
namespace {

using namespace fixture;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Eigen::AlignedBox3d cube(double half, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  return {centre.array() - half, centre.array() + half};
}

std::vector<Eigen::Vector3d> scattered(int count, double half,
                                       const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-half, half);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    points.emplace_back(centre + Eigen::Vector3d(coordinate(random), coordinate(random), coordinate(random)));
  }
  return points;
}

TEST(Bounds, WhatIsGivenComesFirst) {
  Dataset dataset = ring(12, 5);
  dataset.scene_bounds = cube(2);
  dataset.points = scattered(100, 1);
  BoundsOptions options;
  EXPECT_TRUE(default_bounds(dataset, options).box.isApprox(cube(2)));
  options.box = cube(3);
  const SceneBounds bounds = default_bounds(dataset, options);
  EXPECT_TRUE(bounds.box.isApprox(cube(3)));
  EXPECT_THAT(bounds.how, HasSubstr("given"));
}

TEST(Bounds, OptionsThatContradictThemselvesAreErrors) {
  const Dataset dataset = ring(12, 5);
  BoundsOptions negative, reversed, flat;
  negative.near = -1;
  reversed.near = 2;
  reversed.far = 1;
  flat.box = Eigen::AlignedBox3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 1));
  EXPECT_THROW(default_bounds(dataset, negative), InvalidInput);
  EXPECT_THROW(default_bounds(dataset, reversed), InvalidInput);
  EXPECT_THROW(default_bounds(dataset, flat), InvalidInput);
}

TEST(Bounds, RingLooksAtItsMiddle) {
  const Eigen::Vector3d target(3, -2, 1);
  const Dataset dataset = ring(16, 5, target);
  const CameraRig rig = describe_cameras(dataset);
  EXPECT_EQ(rig.layout, CameraLayout::kOutsideIn);
  EXPECT_LT((rig.focus - target).norm(), 1e-9);
  EXPECT_NEAR(rig.focus_depth, 5, 1e-9);
  // A view sees 2 across and 1.5 up from the target at its distance. The box holds a ball that all see,
  // and is not far larger.
  const SceneBounds bounds = default_bounds(dataset);
  EXPECT_TRUE(bounds.box.contains(cube(1.2, target)));
  EXPECT_TRUE(cube(3.2, target).contains(bounds.box));
}

TEST(Bounds, RingFollowsTheUnitOfTheWorld) {
  const SceneBounds one = default_bounds(ring(16, 5)), thousand = default_bounds(ring(16, 5000));
  EXPECT_LT((1000 * one.box.min() - thousand.box.min()).norm(), 1e-6);
  EXPECT_LT((1000 * one.box.max() - thousand.box.max()).norm(), 1e-6);
  EXPECT_NEAR(1000 * one.far, thousand.far, 1e-6);
}

TEST(Bounds, FacadeHoldsTheWallAndNotWhatIsFarBehind) {
  const Dataset dataset = facade(9, 10);
  EXPECT_EQ(describe_cameras(dataset).layout, CameraLayout::kOutsideIn);
  const Eigen::AlignedBox3d box = default_bounds(dataset).box;
  EXPECT_TRUE(
      box.contains(Eigen::AlignedBox3d(Eigen::Vector3d(-3, -0.5, -2.5), Eigen::Vector3d(3, 0.5, 2.5))));
  EXPECT_GT(box.min().y(), -8) << "the cameras stay outside";
  EXPECT_LT(box.max().y(), 8);
}

TEST(Bounds, NadirHoldsTheGround) {
  const double height = 100;
  const Dataset dataset = nadir(5, 6, height);
  EXPECT_EQ(describe_cameras(dataset).layout, CameraLayout::kForward);
  const Eigen::AlignedBox3d box = default_bounds(dataset).box;
  EXPECT_LT(box.min().z(), 0) << "the ground lies within";
  EXPECT_GT(box.max().z(), 0.1 * height);
  EXPECT_LT(box.max().z(), height) << "below the cameras";
  EXPECT_GT(box.min().z(), -2 * height) << "not the whole inside of the earth";
  EXPECT_TRUE(box.contains(Eigen::Vector3d(60, 40, 0)));
}

TEST(Bounds, PanoramasLookOutwards) {
  const Dataset dataset = panoramas({{-10, 0, 2}, {10, 0, 2}, {0, 12, 2}, {0, -8, 3}, {5, 5, 2}});
  EXPECT_EQ(dataset.nodes.size(), 5u);
  const CameraRig rig = describe_cameras(dataset);
  EXPECT_EQ(rig.layout, CameraLayout::kInsideOut);
  EXPECT_NEAR(rig.extent, std::hypot(20, 1), 1e-9) << "from the lowest node to the highest";
  const SceneBounds bounds = default_bounds(dataset);
  EXPECT_TRUE(
      bounds.box.contains(Eigen::AlignedBox3d(Eigen::Vector3d(-12, -10, 0), Eigen::Vector3d(12, 14, 6))))
      << bounds.box.min().transpose() << " .. " << bounds.box.max().transpose();
  EXPECT_TRUE(cube(45).contains(bounds.box));
  for (const DepthRange& range : bounds.views) {
    EXPECT_GT(range.near, 0);
    EXPECT_LT(range.near, 2) << "the ground below the cameras is near";
    EXPECT_GT(range.far, 20);
  }
}

TEST(Bounds, PointsBoundWithoutTheirOutliers) {
  Dataset dataset = ring(16, 5);
  dataset.points = scattered(2000, 0.5);
  for (int i = 0; i < 4; ++i) dataset.points.emplace_back(1.2, -1.2, 1.2 + 0.01 * i);
  const SceneBounds bounds = default_bounds(dataset);
  EXPECT_TRUE(bounds.box.contains(cube(0.5)));
  EXPECT_TRUE(cube(0.7).contains(bounds.box));
  EXPECT_THAT(bounds.how, HasSubstr("points"));
  BoundsOptions without;
  without.use_points = false;
  EXPECT_FALSE(cube(0.7).contains(default_bounds(dataset, without).box));
}

TEST(Bounds, BackgroundPointsDoNotCountWhereCamerasLookAtOnePlace) {
  Dataset dataset = ring(16, 5);
  dataset.points = scattered(500, 0.5);
  const std::vector<Eigen::Vector3d> behind = scattered(500, 3, {40, 0, 0});
  dataset.points.insert(dataset.points.end(), behind.begin(), behind.end());
  EXPECT_TRUE(cube(0.7).contains(default_bounds(dataset).box));
}

TEST(Bounds, PointsSeenByFewViewsDoNotCount) {
  Dataset dataset = panoramas({{-10, 0, 2}, {10, 0, 2}, {0, 12, 2}, {0, -8, 3}});
  dataset.points = scattered(500, 8);
  dataset.point_view_counts.assign(500, 4);
  const std::vector<Eigen::Vector3d> doubtful = scattered(300, 60);
  dataset.points.insert(dataset.points.end(), doubtful.begin(), doubtful.end());
  dataset.point_view_counts.resize(800, 2);
  EXPECT_TRUE(cube(10).contains(default_bounds(dataset).box));
}

TEST(Bounds, OnePlaceWithoutPointsIsAnErrorThatSaysWhatToDo) {
  Dataset dataset = panoramas({{1, 2, 3}});
  try {
    default_bounds(dataset);
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_THAT(error.what(), HasSubstr("bounds given by hand"));
  }
  dataset.points = scattered(100, 5);
  EXPECT_TRUE(default_bounds(dataset).box.contains(cube(4.5)));
}

TEST(Bounds, RangesHoldTheBoxAndGoOnBehindIt) {
  const Dataset dataset = ring(16, 5);
  const SceneBounds bounds = default_bounds(dataset);
  ASSERT_EQ(bounds.views.size(), 16u);
  for (std::size_t v = 0; v < 16; ++v) {
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d x = bounds.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
      const double depth = dataset.views[v].camera.camera_from_world(x).z();
      EXPECT_LT(bounds.views[v].near, std::max(depth, 0.1));
      EXPECT_GT(bounds.views[v].far, depth + bounds.box.diagonal().norm());
    }
    EXPECT_GT(bounds.views[v].near, 0);
    EXPECT_LE(bounds.views[v].far, bounds.far);
  }
}

TEST(Bounds, GivenRangesWin) {
  Dataset dataset = ring(8, 5);
  dataset.views[2].near = 3;
  dataset.views[2].far = 8;
  dataset.views[3].near = 1000;
  BoundsOptions options;
  SceneBounds bounds = default_bounds(dataset, options);
  EXPECT_EQ(bounds.views[2].near, 3);
  EXPECT_EQ(bounds.views[2].far, 8);
  EXPECT_EQ(bounds.views[3].near, 1000);
  EXPECT_GT(bounds.views[3].far, 1000);
  options.near = 0.25;
  options.far = 77;
  bounds = default_bounds(dataset, options);
  for (const DepthRange& range : bounds.views) {
    EXPECT_EQ(range.near, 0.25);
    EXPECT_EQ(range.far, 77);
  }
  EXPECT_EQ(bounds.far, 77);
}

/// Masks of a ball of radius `radius` at the origin, drawn by its silhouette in each view.
PhotographLoader ball_masks(double radius) {
  return [radius](const View& view) {
    Photograph photograph;
    const Intrinsics& k = view.camera.intrinsics;
    photograph.foreground = Mask(k.width, k.height, 0);
    for (int y = 0; y < k.height; ++y) {
      for (int x = 0; x < k.width; ++x) {
        const Ray ray = view.camera.ray(x + 0.5, y + 0.5);
        const Eigen::Vector3d d = ray.direction.normalized();
        const double miss = (ray.origin - ray.origin.dot(d) * d).norm();
        if (miss <= radius) photograph.foreground.at(x, y) = 255;
      }
    }
    return photograph;
  };
}

TEST(MaskBounds, TightenToTheObject) {
  Dataset dataset = ring(16, 5);
  for (View& view : dataset.views) view.mask_path = "mask";
  const Eigen::AlignedBox3d box = tighten_by_masks(cube(2), dataset, ball_masks(0.6));
  EXPECT_TRUE(box.contains(cube(0.6)));
  // The hull of a ring of 16 is a little larger than the ball, most above and below; then a cell of margin.
  EXPECT_TRUE(cube(0.85).contains(box)) << box.min().transpose() << " .. " << box.max().transpose();
}

TEST(MaskBounds, AFewBrokenMasksDoNotCut) {
  Dataset dataset = ring(24, 5);
  for (View& view : dataset.views) view.mask_path = "mask";
  const PhotographLoader good = ball_masks(0.6);
  const PhotographLoader one_empty = [&](const View& view) {
    Photograph photograph = good(view);
    if (view.name == "5") photograph.foreground = Mask(400, 300, 0);
    return photograph;
  };
  EXPECT_TRUE(tighten_by_masks(cube(2), dataset, one_empty).contains(cube(0.6)));
}

TEST(MaskBounds, WithoutMasksOrWithoutForegroundTheBoxStays) {
  Dataset dataset = ring(8, 5);
  const PhotographLoader never = [](const View&) -> Photograph { throw std::logic_error("no mask to load"); };
  EXPECT_TRUE(tighten_by_masks(cube(2), dataset, never).isApprox(cube(2)));
  for (View& view : dataset.views) view.mask_path = "mask";
  const PhotographLoader empty = [](const View&) {
    Photograph photograph;
    photograph.foreground = Mask(400, 300, 0);
    return photograph;
  };
  EXPECT_TRUE(tighten_by_masks(cube(2), dataset, empty).isApprox(cube(2)));
}

TEST(MaskBounds, DefaultBoundsUseThemWhereAsked) {
  Dataset dataset = ring(16, 5);
  for (View& view : dataset.views) view.mask_path = "mask";
  BoundsOptions options;
  options.load_masks = ball_masks(0.6);
  const SceneBounds bounds = default_bounds(dataset, options);
  EXPECT_TRUE(bounds.box.contains(cube(0.6)));
  EXPECT_TRUE(cube(0.9).contains(bounds.box));
  EXPECT_THAT(bounds.how, HasSubstr("masks"));
  options.box = cube(2);
  EXPECT_TRUE(default_bounds(dataset, options).box.isApprox(cube(2))) << "a given box is taken as it is";
}

TEST(BoxVisibility, MeasuresVoxelsInPixels) {
  const Dataset dataset = ring(16, 5);
  BoundsOptions options;
  options.box = cube(0.5);
  const BoxVisibility seen = box_visibility(dataset, default_bounds(dataset, options), 0.01);
  EXPECT_EQ(seen.views, 16);
  EXPECT_EQ(seen.share_seen_twice, 1);
  // 500 px focal length at distance 5: a hundredth is one pixel wide.
  EXPECT_NEAR(seen.median_pixels_per_voxel, 1, 1e-6);
  EXPECT_LE(seen.min_pixels_per_voxel, seen.median_pixels_per_voxel);
  EXPECT_GE(seen.max_pixels_per_voxel, seen.median_pixels_per_voxel);
}

TEST(ScaleWarnings, SayWhatToChange) {
  const Dataset dataset = ring(16, 5);
  BoundsOptions options;
  options.box = cube(0.5);
  const SceneBounds good = default_bounds(dataset, options);
  EXPECT_THAT(scale_warnings(dataset, good, 0.01), IsEmpty());
  const auto fine = scale_warnings(dataset, good, 0.0001);
  ASSERT_EQ(fine.size(), 1u);
  EXPECT_THAT(fine[0], HasSubstr("far under a pixel"));
  EXPECT_THAT(fine[0], HasSubstr("--voxel-size 0.01"));
  const auto coarse = scale_warnings(dataset, good, 0.5);
  ASSERT_EQ(coarse.size(), 1u);
  EXPECT_THAT(coarse[0], HasSubstr("smaller --voxel-size"));
  options.box = cube(0.5, {0, 0, 50});
  const auto unseen = scale_warnings(dataset, default_bounds(dataset, options), 0.01);
  ASSERT_EQ(unseen.size(), 1u);
  EXPECT_THAT(unseen[0], HasSubstr("no view sees the box"));
  options.box = cube(60);
  const Dataset four = ring(4, 5);
  const auto huge = scale_warnings(four, default_bounds(four, options), 0.05);
  ASSERT_FALSE(huge.empty());
  EXPECT_THAT(huge[0], HasSubstr("smaller --bounds"));
}

}  // namespace
}  // namespace roxel

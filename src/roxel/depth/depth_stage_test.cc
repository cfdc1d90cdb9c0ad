#include "roxel/depth/depth_stage.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <numbers>

#include "roxel/depth/refine_fixture.h"

namespace roxel {
namespace {

using fixture::SlantedPlane;

constexpr double kStageVoxel = 0.1;
constexpr int kSize = 2;  ///< so that views made smaller by it are the fixture's

/// Photographs of a plane and depth maps beside it, in memory.
class DepthStage : public ::testing::Test {
 protected:
  void SetUp() override {
    add(0, 0, 0.03, 0.04);
    add(0.6, 0, -0.02, 0.03);
    add(-0.5, 0.2, -0.02, 0.03);
    add(0.1, -0.6, -0.02, 0.03);
    options_.bp = false;
    options_.refine_scale = kSize;
  }

  void add(double x, double y, double error, double ripple) {
    MatchView made = SlantedPlane::view(x, y, 1, error, ripple, kSize);
    View view;
    view.name = std::to_string(dataset_.views.size());
    view.camera = made.camera;
    dataset_.views.push_back(view);
    const int width = made.luma.width(), height = made.luma.height();
    Image rgb(width, height, 3);
    for (std::size_t i = 0; i < rgb.data().size(); ++i) rgb.data()[i] = made.luma.data()[i / 3];
    photographs_[view.name] = {std::move(rgb), {}, {}};
    layers_.push_back({std::move(made.depth), std::move(made.variance), Image(width, height, 1, 1.0f)});
  }

  DepthStageFigures run() {
    refined_.resize(layers_.size());
    DepthFiles files{[&](int v) {
                       ++reads_;
                       return layers_[v];
                     },
                     [&](int v, const DepthLayers& layers) { layers_[v] = layers; },
                     [&](int v, const RefinedView& view) { refined_[v] = view; },
                     [&](int v) { return refined_[v]; }};
    files.most_held_bytes = most_held_bytes_;
    RunContext context(1);
    return run_depth_stage(
        dataset_, [&](const View& view) { return photographs_.at(view.name); }, {1, kStageVoxel}, files,
        options_, context);
  }

  /// Median of the first view's errors, away from its border.
  double median_error(const Image& depth) const {
    std::vector<double> errors;
    for (int y = 12; y < depth.height() - 12; ++y)
      for (int x = 12; x < depth.width() - 12; ++x)
        errors.push_back(std::abs(*depth.pixel(x, y) - truth(x, y)));
    std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
    return errors[errors.size() / 2];
  }
  double truth(int x, int y) const {
    return SlantedPlane::depth(dataset_.views[0].camera.ray(x + 0.5, y + 0.5));
  }
  Eigen::Vector3d normal(int x, int y) const {
    const float* n = layers_[0].normal.pixel(x, y);
    return {n[0], n[1], n[2]};
  }

  Dataset dataset_;
  std::map<std::string, Photograph> photographs_;
  std::vector<DepthLayers> layers_;
  std::vector<RefinedView> refined_;
  DepthStageOptions options_;
  std::size_t most_held_bytes_ = DepthFiles{}.most_held_bytes;
  int reads_ = 0;  ///< of depth maps
};

TEST_F(DepthStage, ViewsThatAreNotHeldAreReadAgainAndNothingElseChanges) {
  const std::vector<DepthLayers> before = layers_;
  run();
  const int once = reads_;
  const Image held = layers_[0].depth_refined;
  layers_ = before;
  options_.refine_views = 2;
  run();
  const int few = reads_ - once;
  const Image few_held = layers_[0].depth_refined;
  layers_ = before;
  most_held_bytes_ = 0;
  run();
  EXPECT_EQ(few, once);
  EXPECT_GT(reads_ - once - few, few);
  EXPECT_EQ(layers_[0].depth_refined.data(), few_held.data());
  EXPECT_NE(held.data(), few_held.data());
}

TEST_F(DepthStage, RefinesAllPixelsFromViewsMadeSmaller) {
  const double before = median_error(layers_[0].depth);
  const DepthStageFigures figures = run();
  EXPECT_EQ(figures.refine_scale, kSize);
  EXPECT_EQ(figures.refined_pixels, 4 * 144 * 112);
  EXPECT_GT(figures.agreed_pixels, 0.7 * figures.refined_pixels);
  EXPECT_GT(before, 0.02);
  EXPECT_LT(median_error(layers_[0].depth_refined), 0.1 * before);
  for (const auto& [x, y] : {std::pair{20, 20}, {72, 56}, {120, 90}})
    EXPECT_GT(normal(x, y).dot(SlantedPlane::normal()), 0.99);
}

// Squares of pixels take the surest one's depth: that of another surface is not this pixel's.
TEST_F(DepthStage, PixelsOfAnotherSurfaceStay) {
  DepthLayers& first = layers_[0];
  const auto [x, y] = std::pair{61, 41};
  *first.depth.pixel(x, y) = static_cast<float>(truth(x, y) - 5 * kStageVoxel);
  *first.variance.pixel(x, y) = 0.02f;
  const float depth = *first.depth.pixel(x, y);
  run();
  EXPECT_EQ(*first.depth_refined.pixel(x, y), depth);
  EXPECT_EQ(*first.variance_refined.pixel(x, y), 0.02f);
  EXPECT_NEAR(normal(x, y).norm(), 1, 1e-5);  // the volume's
  EXPECT_NEAR(*first.depth_refined.pixel(x + 1, y), truth(x + 1, y), 0.01);
}

TEST_F(DepthStage, AMoveThatNoOtherViewConfirmsIsTakenBack) {
  const auto off = [&](int v, float by, float variance) {
    for (float& z : layers_[v].depth.data()) z += by;
    for (float& value : layers_[v].variance.data()) value = variance;
  };
  off(0, 0.15f, 0.3f * 0.3f);                          // the photographs say by how much
  for (const int v : {1, 2, 3}) off(v, 0.3f, 1e-10f);  // and these do not listen
  const Image before = layers_[0].depth;
  run();
  const auto [x, y] = std::pair{72, 56};
  EXPECT_EQ(*layers_[0].depth_refined.pixel(x, y), *before.pixel(x, y));
  EXPECT_NEAR(*layers_[0].variance_refined.pixel(x, y), 0.09, 1e-6);
  EXPECT_GT(normal(x, y).dot(SlantedPlane::normal()), 0.9);
  options_.refine_agree = false;
  run();
  EXPECT_LT(median_error(layers_[0].depth_refined), 0.02);
}

// What another view takes from the volume alone confirms nothing.
TEST_F(DepthStage, ViewsWithoutTextureConfirmNothing) {
  options_.refine_scale = 1;
  const DepthStageFigures seen = run();
  EXPECT_GT(seen.agreed_pixels, 0.7 * seen.refined_pixels);
  for (auto& [name, photograph] : photographs_)
    for (float& value : photograph.rgb.data()) value = 0.5f;
  const DepthStageFigures blank = run();
  EXPECT_EQ(blank.matched_pixels, 0);
  EXPECT_EQ(blank.agreed_pixels, 0);
}

TEST_F(DepthStage, FilledPixelsKeepTheVarianceThatTheyWereFilledWith) {
  for (auto& [name, photo] : photographs_) std::fill(photo.rgb.data().begin(), photo.rgb.data().end(), 0.4f);
  DepthLayers& layers = layers_[0];
  layers.depth_bp = layers.depth;
  layers.variance_bp = Image(layers.depth.width(), layers.depth.height(), 1, 0.09f);
  *layers.opacity.pixel(40, 40) = 0.3f;  // its depth is not believed, but belief propagation has given it one
  run();
  EXPECT_FLOAT_EQ(*layers.variance_refined.pixel(40, 40), 0.09f);
  EXPECT_FLOAT_EQ(*layers.variance_refined.pixel(60, 40), *layers.variance.pixel(60, 40));
}

/// Cameras that look at the origin from afar; angles in degrees around y.
class ChooseSources : public ::testing::Test {
 protected:
  void add(double degrees, double distance = 4) {
    const double angle = degrees * std::numbers::pi / 180;
    View view;
    view.camera.intrinsics = {64, 48, 80, 80, 32, 24, 0};
    view.camera.pose.centre = distance * Eigen::Vector3d(std::sin(angle), 0, -std::cos(angle));
    view.camera.pose.rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
    dataset_.views.push_back(view);
  }
  std::vector<int> chosen(int most) const { return choose_sources(dataset_, 0, depth_, most); }
  Dataset dataset_;
  Image depth_{64, 48, 1, 4.0f};
};

TEST_F(ChooseSources, AnglesThatFixDepthComeFirst) {
  for (const double degrees : {0.0, 2.0, 18.0, 60.0, 5.0}) add(degrees);
  EXPECT_EQ(chosen(9), (std::vector<int>{2, 4, 3, 1}));
  EXPECT_EQ(chosen(2), (std::vector<int>{2, 4}));
}

TEST_F(ChooseSources, ViewsOfNothingThatIsSeenAreLeftOut) {
  for (const double degrees : {0.0, 15.0, 180.0}) add(degrees);
  dataset_.views[2].camera.pose.centre.z() -= 40;  // looks away from all points
  add(0);                                          // from the same place: says nothing of depth
  EXPECT_EQ(chosen(9), (std::vector<int>{1}));
}

TEST_F(ChooseSources, SharperAndBlunterViewsSayLess) {
  add(0);
  add(15, 12);
  add(15, 4);
  EXPECT_EQ(chosen(9), (std::vector<int>{2, 1}));
}

}  // namespace
}  // namespace roxel

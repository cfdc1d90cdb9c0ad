#include "roxel/depth/refine_view.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "roxel/depth/agree_views.h"
#include "roxel/depth/refine_fixture.h"

namespace roxel {
namespace {

using fixture::SlantedPlane;

struct Errors {
  double median = 0, largest = 0, within_two_sigma = 0;
};

Errors errors_of(const PlaneMap& planes, const Image& variance, const PinholeCamera& camera, int margin) {
  std::vector<double> errors;
  int covered = 0;
  for (int y = margin; y < planes.height - margin; ++y)
    for (int x = margin; x < planes.width - margin; ++x) {
      const double w = 1 / SlantedPlane::depth(camera.ray(x + 0.5, y + 0.5));
      const double error = std::abs(planes.at(x, y).w - w) / (w * w);
      errors.push_back(error);
      covered += error < 2 * std::sqrt(*variance.pixel(x, y)) / (w * w);
    }
  std::sort(errors.begin(), errors.end());
  return {errors[errors.size() / 2], errors.back(), covered / static_cast<double>(errors.size())};
}

class RefineView : public ::testing::Test {
 protected:
  void SetUp() override {
    view_ = SlantedPlane::view(0, 0, 1, 0.03, 0.04);
    for (const auto& [x, y, light] : {std::array{0.6, 0.0, 1.0}, {-0.5, 0.2, 0.6}, {0.1, -0.6, 1.3}})
      sources_.push_back(SlantedPlane::view(x, y, light, -0.02, 0.03));
    options_.patch.gap = 0.2;
    start_ = fit_planes(view_.depth, view_.variance, 90, 3);
  }
  RefinedView refine(int threads = 1) const {
    std::vector<const MatchView*> pointers;
    for (const MatchView& source : sources_) pointers.push_back(&source);
    return refine_view(view_, pointers, start_, options_, RunContext(threads));
  }
  MatchView view_;
  std::vector<MatchView> sources_;
  PlaneMap start_;
  PatchMatchOptions options_;
};

TEST_F(RefineView, FindsThePlaneThatThePhotographsShow) {
  const Errors before = errors_of(start_, Image(72, 56, 1, 1.0f), view_.camera, 6);
  const RefinedView refined = refine();
  const Errors after = errors_of(refined.planes, refined.variance, view_.camera, 6);
  EXPECT_GT(before.median, 0.02);
  EXPECT_LT(after.median, 0.003);  // a tenth
  EXPECT_LT(after.largest, before.largest);
  EXPECT_GT(after.within_two_sigma, 0.9);
  for (int y = 10; y < 46; y += 6)
    for (int x = 10; x < 62; x += 6) {
      const Eigen::Vector3d normal = world_normal(view_.camera, refined.planes.at(x, y), x + 0.5, y + 0.5);
      EXPECT_GT(normal.dot(SlantedPlane::normal()), std::cos(6 * std::numbers::pi / 180)) << x << " " << y;
    }
}

// As where the volume has a false surface, for all views alike.
TEST_F(RefineView, FindsThePlaneThoughTheVolumeIsSureOfAFalseOneInFront) {
  view_ = SlantedPlane::view(0, 0, 1, -0.4, 0);  // eight deviations
  sources_.clear();
  for (const auto& [x, y] : {std::array{0.6, 0.0}, {-0.5, 0.2}, {0.1, -0.6}})
    sources_.push_back(SlantedPlane::view(x, y, 1, -0.4, 0));
  start_ = fit_planes(view_.depth, view_.variance, 90, 3);
  options_.sigmas = 4;
  const RefinedView held = refine();
  EXPECT_GT(errors_of(held.planes, held.variance, view_.camera, 8).median, 0.15);
  options_.sigmas = PatchMatchOptions().sigmas;
  const RefinedView refined = refine();
  const Errors after = errors_of(refined.planes, refined.variance, view_.camera, 8);
  EXPECT_LT(after.median, 0.01);
  EXPECT_GT(after.within_two_sigma, 0.8);
}

// Where texture is faint the least squares feel the volume, too, but far from it hardly.
TEST_F(RefineView, FaintTextureIsNotPulledBackToAFalseSurface) {
  const double faint = 0.1;
  view_ = SlantedPlane::view(0, 0, faint, -0.4, 0);
  sources_.clear();
  for (const auto& [x, y] : {std::array{0.6, 0.0}, {-0.5, 0.2}, {0.1, -0.6}})
    sources_.push_back(SlantedPlane::view(x, y, faint, -0.4, 0));
  start_ = fit_planes(view_.depth, view_.variance, 90, 3);
  const RefinedView refined = refine();
  EXPECT_LT(errors_of(refined.planes, refined.variance, view_.camera, 8).median, 0.025);
}

TEST_F(RefineView, LightThatDiffersBetweenPhotographsDoesNotMatter) {
  const RefinedView as_it_is = refine();
  for (MatchView& source : sources_)
    for (float& value : source.luma.data()) value = 0.8f * value + 0.1f;
  const RefinedView dimmed = refine();
  const double a = errors_of(as_it_is.planes, as_it_is.variance, view_.camera, 6).median;
  const double b = errors_of(dimmed.planes, dimmed.variance, view_.camera, 6).median;
  EXPECT_NEAR(a, b, 3e-4);
}

// Photographs that were straightened end in pixels that show nothing.
TEST_F(RefineView, AViewThatShowsNothingThereLeavesTheOthersToDecide) {
  for (MatchView& blind : sources_) {
    const Image seen = blind.luma;
    std::fill(blind.luma.data().begin(), blind.luma.data().end(), std::numeric_limits<float>::quiet_NaN());
    const RefinedView refined = refine();
    blind.luma = seen;
    EXPECT_LT(errors_of(refined.planes, refined.variance, view_.camera, 6).median, 0.004);
  }
}

TEST_F(RefineView, IsTheSameForAnyNumberOfThreads) {
  const RefinedView one = refine(1);
  for (const int threads : {2, 4}) {
    const RefinedView more = refine(threads);
    EXPECT_EQ(one.variance.data(), more.variance.data());
    for (std::size_t i = 0; i < one.planes.planes.size(); ++i) {
      EXPECT_EQ(one.planes.planes[i].w, more.planes.planes[i].w);
      EXPECT_EQ(one.planes.planes[i].wu, more.planes.planes[i].wu);
    }
  }
}

TEST_F(RefineView, OtherSeedsDrawOtherPlanesAndFindTheSame) {
  const RefinedView one = refine();
  options_.seed = 2;
  const RefinedView two = refine();
  EXPECT_NE(one.variance.data(), two.variance.data());
  EXPECT_NEAR(errors_of(one.planes, one.variance, view_.camera, 6).median,
              errors_of(two.planes, two.variance, view_.camera, 6).median, 5e-4);
}

TEST_F(RefineView, WithoutTextureTheVolumeIsBelieved) {
  for (float& value : view_.luma.data()) value = 0.5f;
  for (MatchView& source : sources_)
    for (float& value : source.luma.data()) value = 0.5f;
  const RefinedView refined = refine();
  for (int y = 6; y < 50; ++y)
    for (int x = 6; x < 66; ++x) {
      const float w = start_.at(x, y).w;
      EXPECT_NEAR(refined.planes.at(x, y).w, w, 2e-3 * w);
      const double sigma = std::sqrt(*refined.variance.pixel(x, y)) / (w * w);
      EXPECT_NEAR(sigma, 0.05, 0.01);
    }
}

TEST_F(RefineView, ViewsBehindAnotherSurfaceAreNotAsked) {
  // Something near, of another texture, stands before all other cameras.
  for (MatchView& source : sources_) {
    for (float& z : source.depth.data()) z *= 0.5f;
    for (std::size_t i = 0; i < source.luma.data().size(); ++i)
      source.luma.data()[i] = static_cast<float>(0.5 + 0.3 * std::sin(0.9 * static_cast<double>(i)));
  }
  const RefinedView refined = refine();
  for (std::size_t i = 0; i < start_.planes.size(); ++i) {
    EXPECT_EQ(refined.planes.planes[i].w, start_.planes[i].w);
    EXPECT_EQ(refined.correlation.data()[i], 0);
  }
}

TEST_F(RefineView, PixelsWithoutDepthStayWithout) {
  for (int x = 0; x < 72; ++x) start_.at(x, 20) = {};
  const RefinedView refined = refine();
  for (int x = 0; x < 72; ++x) EXPECT_TRUE(refined.planes.at(x, 20).empty());
}

/// A view that is right but for noise of that deviation of depth, and says so.
RefinedView noisy_view(const PinholeCamera& camera, double sigma, unsigned seed) {
  RefinedView view{PlaneMap(72, 56), Image(72, 56, 1), Image(72, 56, 1), Image(72, 56, 1, 1.0f)};
  unsigned state = seed;
  for (int y = 0; y < 56; ++y)
    for (int x = 0; x < 72; ++x) {
      double noise = -6;
      for (int k = 0; k < 12; ++k) noise += ((state = state * 1664525u + 1013904223u) >> 8) / double(1 << 24);
      const double w = 1 / SlantedPlane::depth(camera.ray(x + 0.5, y + 0.5));
      PixelPlane plane = plane_of_normal(camera, w, SlantedPlane::normal(), x + 0.5, y + 0.5);
      plane.w += static_cast<float>(sigma * noise * w * w);
      view.planes.at(x, y) = plane;
      *view.variance.pixel(x, y) = static_cast<float>(sigma * sigma * w * w * w * w);
    }
  return view;
}

TEST(AgreeViews, TheirMeanIsNearerToTheTruth) {
  const PinholeCamera own = SlantedPlane::camera(0, 0);
  const RefinedView view = noisy_view(own, 0.02, 1);
  std::vector<RefinedView> others;
  std::vector<AgreeingView> asked;
  for (int k = 0; k < 3; ++k)
    others.push_back(
        noisy_view(SlantedPlane::camera(0.3 * k - 0.4, 0.2), 0.02, static_cast<unsigned>(k) + 2));
  for (int k = 0; k < 3; ++k)
    asked.push_back({&others[k], PatchWarp(own, SlantedPlane::camera(0.3 * k - 0.4, 0.2))});
  const AgreedView agreed = agree_views(view, asked, RunContext(2));
  const double before = errors_of(view.planes, view.variance, own, 10).median;
  const double after = errors_of(agreed.planes, agreed.variance, own, 10).median;
  EXPECT_LT(after, 0.65 * before);  // four witnesses: half
  EXPECT_NEAR(agreed.stretch, 1, 0.15);
  EXPECT_EQ(*agreed.views.pixel(36, 28), 3);
}

TEST(AgreeViews, DifferencesThatDeviationsDoNotExplainStretchThem) {
  const PinholeCamera own = SlantedPlane::camera(0, 0);
  RefinedView view = noisy_view(own, 0.02, 1), other = noisy_view(SlantedPlane::camera(0.3, 0), 0.02, 2);
  for (RefinedView* v : {&view, &other})
    for (float& variance : v->variance.data()) variance /= 9;
  const std::vector<AgreeingView> asked{{&other, PatchWarp(own, SlantedPlane::camera(0.3, 0))}};
  EXPECT_NEAR(agree_views(view, asked, RunContext(1)).stretch, 3, 0.3);
}

TEST(AgreeViews, AnotherSurfaceHasNoSay) {
  const PinholeCamera own = SlantedPlane::camera(0, 0);
  const RefinedView view = noisy_view(own, 0.01, 1);
  RefinedView other = noisy_view(SlantedPlane::camera(0.3, 0), 0.01, 2);
  for (PixelPlane& plane : other.planes.planes) plane.w *= 2;
  const std::vector<AgreeingView> asked{{&other, PatchWarp(own, SlantedPlane::camera(0.3, 0))}};
  const AgreedView agreed = agree_views(view, asked, RunContext(1));
  EXPECT_EQ(agreed.planes.at(36, 28).w, view.planes.at(36, 28).w);
  EXPECT_EQ(*agreed.views.pixel(36, 28), 0);
}

}  // namespace
}  // namespace roxel

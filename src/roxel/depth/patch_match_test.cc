#include "roxel/depth/patch_match.h"

#include <gtest/gtest.h>

#include "roxel/depth/refine_fixture.h"

namespace roxel {
namespace {

using fixture::SlantedPlane;

/// A patch compared in doubles, sample by sample, from its definition.
struct SlowPatch {
  const MatchView &own, &other;
  PatchOptions options;

  static double bilinear_luma(const Image& image, double u, double v) {
    const double x = u - 0.5, y = v - 0.5;
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    const double s = x - x0, t = y - y0;
    return (1 - t) * ((1 - s) * *image.pixel(x0, y0) + s * *image.pixel(x0 + 1, y0)) +
           t * ((1 - s) * *image.pixel(x0, y0 + 1) + s * *image.pixel(x0 + 1, y0 + 1));
  }

  double correlation(const PlaneMap& surface, int x, int y, const PixelPlane& plane) const {
    double sum = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    const double r = options.radius, middle = *own.luma.pixel(x, y);
    const PixelPlane& start = surface.at(x, y);
    for (int dy = -options.radius; dy <= options.radius; ++dy)
      for (int dx = -options.radius; dx <= options.radius; ++dx) {
        const PixelPlane& there = surface.at(x + dx, y + dy);
        const double expected = start.w + start.wu * dx + start.wv * dy;
        if (there.empty() || std::abs(there.w - expected) > options.gap * start.w * start.w) continue;
        const double value = *own.luma.pixel(x + dx, y + dy), unlike = (value - middle) / 0.12;
        const double weight = std::exp(-0.5 * unlike * unlike - 0.5 * (dx * dx + dy * dy) / (r * r));
        if (weight < 0.01) continue;
        // The pixel's point on the plane, seen by the other camera.
        const double inverse_depth = plane.w + plane.wu * dx + plane.wv * dy;
        const Ray ray = own.camera.ray(x + dx + 0.5, y + dy + 0.5);
        const Eigen::Vector3d seen = other.camera.project(ray.origin + ray.direction / inverse_depth);
        const double sample = bilinear_luma(other.luma, seen.x(), seen.y());
        sum += weight, a += weight * value, b += weight * sample;
        aa += weight * value * value, bb += weight * sample * sample, ab += weight * value * sample;
      }
    a /= sum, b /= sum;
    const double n = options.noise * options.noise;
    return (ab / sum - a * b) / std::sqrt((aa / sum - a * a + n) * (bb / sum - b * b + n));
  }
};

class PatchMatch : public ::testing::Test {
 protected:
  PatchMatch()
      : own_(SlantedPlane::view(0, 0, 1, 0, 0)),
        other_(SlantedPlane::view(0.4, -0.2, 0.7, 0, 0)),
        surface_(fit_planes(own_.depth, own_.variance, 90, 3)),
        source_{&other_.luma, PatchWarp(own_.camera, other_.camera)} {
    options_.gap = 0.5;
  }
  Patch patch(int x, int y) const { return Patch(own_.luma, {}, surface_, x, y, options_); }

  MatchView own_, other_;
  PlaneMap surface_;
  PatchSource source_;
  PatchOptions options_;
};

TEST_F(PatchMatch, CorrelationIsThatOfItsDefinition) {
  const SlowPatch slow{own_, other_, options_};
  for (const auto& [x, y] : {std::pair(30, 25), {40, 30}, {36, 28}, {45, 22}})
    for (const float off : {0.97f, 1.0f, 1.02f}) {
      PixelPlane plane = surface_.at(x, y);
      plane.w *= off;
      plane.wu += 0.0005f;
      const float found = patch(x, y).correlation(source_, plane);
      EXPECT_NEAR(found, slow.correlation(surface_, x, y, plane), 2e-4) << x << " " << y << " " << off;
    }
}

TEST_F(PatchMatch, SamplesOfAnotherSurfaceAreLeftOut) {
  for (int y = 0; y < surface_.height; ++y)
    for (int x = 38; x < surface_.width; ++x) surface_.at(x, y).w *= 1.5f;
  const SlowPatch slow{own_, other_, options_};
  const PixelPlane plane = surface_.at(36, 28);
  EXPECT_NEAR(patch(36, 28).correlation(source_, plane), slow.correlation(surface_, 36, 28, plane), 2e-4);
  EXPECT_LT(patch(36, 28).sample_count(), 0.9 * patch(20, 28).sample_count());
}

TEST_F(PatchMatch, IsBestOnTheTruePlaneWhateverTheLight) {
  const PixelPlane plane = surface_.at(36, 28);
  PixelPlane nearer = plane;
  nearer.w *= 1.02f;
  EXPECT_GT(patch(36, 28).correlation(source_, plane), 0.99f);
  EXPECT_LT(patch(36, 28).correlation(source_, nearer), 0.98f);
}

TEST_F(PatchMatch, NormalEquationsAreTheDerivativesOfTheResidual) {
  options_.noise = 1e-5;  // what is granted to noise moves the gain, which the derivative takes to be free
  PixelPlane plane = surface_.at(36, 28);
  plane.w *= 1.01f;
  const Patch here = patch(36, 28);
  const Patch::Equations at = here.linearise(source_, plane);
  ASSERT_TRUE(at.valid);
  EXPECT_NEAR(at.gain, 1 / 0.7, 0.4);
  float PixelPlane::*const numbers[3] = {&PixelPlane::w, &PixelPlane::wu, &PixelPlane::wv};
  const float steps[3] = {2e-4f, 4e-5f, 4e-5f};
  for (int k = 0; k < 3; ++k) {
    PixelPlane before = plane, after = plane;
    before.*numbers[k] -= steps[k];
    after.*numbers[k] += steps[k];
    const double change =
        (here.linearise(source_, after).residual - here.linearise(source_, before).residual) / (2 * steps[k]);
    EXPECT_NEAR(-2 * at.b[k], change, 0.03 * std::abs(change)) << k;
  }
}

TEST_F(PatchMatch, AStepOfTheEquationsLeadsToTheTruePlane) {
  const PixelPlane truth = surface_.at(36, 28);
  PixelPlane plane = truth;
  plane.w *= 1.004f;
  for (int round = 0; round < 4; ++round) {
    const Patch::Equations e = patch(36, 28).linearise(source_, plane);
    ASSERT_TRUE(e.valid);
    Eigen::Matrix3d a;
    a << e.a[0], e.a[1], e.a[2], e.a[1], e.a[3], e.a[4], e.a[2], e.a[4], e.a[5];
    const Eigen::Vector3d step = a.ldlt().solve(Eigen::Vector3d(e.b[0], e.b[1], e.b[2]));
    plane.w += static_cast<float>(step.x());
    plane.wu += static_cast<float>(step.y());
    plane.wv += static_cast<float>(step.z());
  }
  EXPECT_NEAR(plane.w / truth.w, 1, 3e-4);
}

TEST_F(PatchMatch, APatchThatLeavesTheImageHasNoCorrelation) {
  EXPECT_TRUE(std::isnan(patch(2, 28).correlation(source_, surface_.at(2, 28))));
  EXPECT_FALSE(patch(2, 28).linearise(source_, surface_.at(2, 28)).valid);
}

}  // namespace
}  // namespace roxel

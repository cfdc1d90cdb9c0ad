#include "roxel/solve/fit_colors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "roxel/base/error.h"
#include "roxel/march/render.h"
#include "roxel/solve/cube_fixture.h"

namespace roxel {
namespace {

constexpr Rgb kBehind = {0.1f, 0.2f, 0.4f};

/// A wall two voxels thick in the plane z = 0 whose true colours change from voxel to voxel, photographed
/// from above, and a volume that knows its opacities and of the colours only what is left of them after
/// blurring.
class PaintedWall : public ::testing::Test {
 protected:
  /// `bricks` a side; the wall is as wide for any.
  explicit PaintedWall(int bricks = 2, int pixels = 48) : side_(8 * bricks), pixels_(pixels) {
    const double voxel = 1.6 / side_;
    Topology topology(LatticeFrame{{-0.8, -0.8, -4 * voxel}, voxel, {bricks, bricks, 1}});
    for (int z = 3; z < 5; ++z)
      for (int y = 0; y < side_; ++y)
        for (int x = 0; x < side_; ++x) topology.insert({x, y, z});
    volume_ = Volume({topology});
    volume_.resize_channels();
    truth_.resize(volume_.slot_count());
    for_each_voxel([&](const Eigen::Vector3i& ijk, std::uint32_t slot) {
      volume_.tau[slot] = tau_from_alpha(ijk.z() == 4 ? 0.95f : 0.9f);
      truth_[slot] = paint(ijk.x(), ijk.y());
    });
    for_each_voxel([&](const Eigen::Vector3i& ijk, std::uint32_t slot) {
      Rgb sum{0, 0, 0};
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const Rgb at =
              paint(std::clamp(ijk.x() + dx, 0, side_ - 1), std::clamp(ijk.y() + dy, 0, side_ - 1));
          for (int c = 0; c < 3; ++c) sum[c] += at[c] / 9;
        }
      volume_.color_mean[slot] = sum;
    });
    for (int v = 0; v < 8; ++v) {
      View view;
      view.name = std::to_string(v);
      view.camera = fixture::camera_looking_at_origin({0.9 * std::cos(0.8 * v), 0.9 * std::sin(0.8 * v), 2.5},
                                                      pixels_, 2.4 * pixels_ / 2);
      view.lens.intrinsics = view.camera.intrinsics;
      dataset_.views.push_back(view);
    }
    assign_nodes(dataset_);
    scene_.transform = ColorTransform(ColorSpace::kRgb, kWhiteD65);
    scene_.voxel_size = voxel;
    scene_.bounds.box = volume_.index(0).frame().box();
    scene_.bounds.views.assign(dataset_.views.size(), {0.1, 10});
    scene_.background.kind = BackgroundKind::kKnown;
    std::copy(kBehind.begin(), kBehind.end(), scene_.background.mean);
    scene_.memory.peak_bytes = 1e12;
  }

  const int side_, pixels_;

  static Rgb paint(int x, int y) {
    const auto wave = [&](double a, double b) {
      return static_cast<float>(0.4 + 0.3 * std::sin(a * x + b * y));
    };
    return {wave(2.3, 0.4), wave(0.3, 2.6), wave(1.7, 1.9)};
  }

  template <class Visit>
  void for_each_voxel(Visit&& visit) const {
    for (int z = 3; z < 5; ++z)
      for (int y = 0; y < side_; ++y)
        for (int x = 0; x < side_; ++x) visit(Eigen::Vector3i(x, y, z), volume_.index(0).slot({x, y, z}));
  }

  Rgb light_of(int view) const { return scene_.light.of_view(view); }

  /// Photographs of the truth, in each view's light.
  PhotographLoader photographs() const {
    return [this](const View& view) {
      const int v = static_cast<int>(&view - dataset_.views.data());
      const LatticeStack stack(volume_);
      RenderOptions options;
      options.interpolate = true;
      options.background = kBehind;
      Photograph photo;
      photo.rgb = render(stack, truth_, view.camera, {0.1, 10}, options, RunContext(1)).rgb;
      for (std::size_t i = 0; i < photo.rgb.data().size(); ++i) photo.rgb.data()[i] *= light_of(v)[i % 3];
      if (v == spoilt_view_)
        for (int y = pixels_ / 2; y < pixels_; ++y)
          for (int x = 0; x < pixels_; ++x) std::fill_n(photo.rgb.pixel(x, y), 3, 1.0f);
      return photo;
    };
  }

  ColorFitRecord fit(Volume& volume, int threads = 1) const {
    const RunContext context(threads);
    return fit_colors(
        dataset_, photographs(), scene_, nullptr, context, [](double) {}, volume);
  }

  /// Root mean square error of the upper voxels' colours, without the outermost.
  double error(const std::vector<Rgb>& colors) const {
    double sum = 0;
    int count = 0;
    for_each_voxel([&](const Eigen::Vector3i& ijk, std::uint32_t slot) {
      if (ijk.z() != 4 || ijk.head<2>().minCoeff() < 1 || ijk.head<2>().maxCoeff() > side_ - 2) return;
      for (int c = 0; c < 3; ++c, ++count) sum += std::pow(colors[slot][c] - truth_[slot][c], 2);
    });
    return std::sqrt(sum / count);
  }

  Volume volume_;
  std::vector<Rgb> truth_;
  Dataset dataset_;
  Scene scene_;
  int spoilt_view_ = -1;
};

TEST_F(PaintedWall, BlurredColoursBecomeTheTrueOnes) {
  ASSERT_GT(error(volume_.color_mean), 0.1);
  const std::vector<Rgb> means = volume_.color_mean;
  const ColorFitRecord record = fit(volume_);
  EXPECT_LT(error(volume_.fitted_color), 0.02);
  EXPECT_LT(record.rms_after_percent, 0.15 * record.rms_before_percent);
  EXPECT_GE(record.rounds, 3);
  EXPECT_GT(record.pixels, 8 * 500);
  EXPECT_EQ(volume_.color_mean, means);  // statistics stay what they are
}

TEST_F(PaintedWall, RendersComeNearThePhotographs) {
  fit(volume_);
  const LatticeStack stack(volume_);
  RenderOptions options;
  options.interpolate = true;
  options.background = kBehind;
  const Image photo = photographs()(dataset_.views[2]).rgb;
  const auto miss = [&](const std::vector<Rgb>& colors) {
    const Image seen = render(stack, colors, dataset_.views[2].camera, {0.1, 10}, options, RunContext(1)).rgb;
    double sum = 0;
    for (std::size_t i = 0; i < seen.data().size(); ++i) sum += std::pow(seen.data()[i] - photo.data()[i], 2);
    return sum;
  };
  EXPECT_LT(miss(volume_.fitted_color), 0.03 * miss(volume_.color_mean));
}

TEST_F(PaintedWall, SameBitsForAnyThreadsAndAnyMemory) {
  Volume one = volume_;
  fit(one);
  for (const int threads : {2, 4}) {
    Volume many = volume_;
    fit(many, threads);
    EXPECT_EQ(one.fitted_color, many.fitted_color);
  }
  scene_.memory.peak_bytes = 0;  // no room: every round marches again
  Volume tight = volume_;
  fit(tight, 2);
  EXPECT_EQ(one.fitted_color, tight.fitted_color);
}

/// So many voxels and pixels that threads meet in sums and parts; four rays a pixel.
class WideWall : public PaintedWall {
 protected:
  WideWall() : PaintedWall(16, 120) {}
};

TEST_F(WideWall, SameBitsForAnyThreadsAndAnyMemory) {
  ASSERT_EQ(SubpixelRays(volume_.index(0).frame(), dataset_.views[0].camera).count(), 4);
  ASSERT_GT(volume_.slot_count(), 1u << 14);
  Volume one = volume_;
  const ColorFitRecord record = fit(one);
  EXPECT_LT(record.rms_after_percent, 0.5 * record.rms_before_percent);
  for (const double room : {1e12, 0.0}) {
    scene_.memory.peak_bytes = room;
    Volume many = volume_;
    fit(many, 4);
    EXPECT_EQ(one.fitted_color, many.fitted_color);
  }
}

TEST_F(PaintedWall, WhatIsBehindAnUnknownBackgroundIsNotPaintedOntoTheWall) {
  // The wall lets a third of the light through, and what is seen through it is of its own colour.
  std::fill(volume_.tau.begin(), volume_.tau.end(), tau_from_alpha(0.42f));
  scene_.background.kind = BackgroundKind::kUnknown;
  std::fill(truth_.begin(), truth_.end(), Rgb{0.5f, 0.4f, 0.3f});
  std::fill(volume_.color_mean.begin(), volume_.color_mean.end(), Rgb{0.5f, 0.4f, 0.3f});
  const PhotographLoader plain = [&](const View&) {
    Photograph photo;
    photo.rgb = Image(pixels_, pixels_, 3);
    for (std::size_t i = 0; i < photo.rgb.data().size(); ++i) photo.rgb.data()[i] = truth_[0][i % 3];
    return photo;
  };
  fit_colors(
      dataset_, plain, scene_, nullptr, RunContext(1), [](double) {}, volume_);
  EXPECT_LT(error(volume_.fitted_color), 0.01);
}

TEST_F(PaintedWall, LightIsDividedOut) {
  for (int v = 0; v < 8; ++v) scene_.light.of_views.push_back({0.6f + 0.1f * v, 1.0f, 1.3f - 0.1f * v});
  fit(volume_);
  EXPECT_LT(error(volume_.fitted_color), 0.02);
}

TEST_F(PaintedWall, WhatStandsBeforeOneCameraIsNotBelieved) {
  Volume clean = volume_;
  fit(clean);
  spoilt_view_ = 3;
  fit(volume_);
  // 0.010; half a photograph in eight of white that counted in full would make it 0.023.
  EXPECT_LT(error(clean.fitted_color), 0.006);
  EXPECT_LT(error(volume_.fitted_color), 0.015);
}

TEST_F(PaintedWall, MasksAndInvalidPixelsAreNotLookedAt) {
  const PhotographLoader all = photographs();
  const PhotographLoader cut = [&](const View& view) {
    Photograph photo = all(view);
    photo.valid = Mask(pixels_, pixels_, 255);
    photo.foreground = Mask(pixels_, pixels_, 255);
    for (int y = 0; y < pixels_; ++y)
      for (int x = 0; x < pixels_; ++x) {
        if (x < pixels_ / 4) photo.valid.at(x, y) = 0;
        if (x >= 3 * pixels_ / 4) photo.foreground.at(x, y) = 0;
        if (x < pixels_ / 4 || x >= 3 * pixels_ / 4) std::fill_n(photo.rgb.pixel(x, y), 3, 1.0f);
      }
    return photo;
  };
  const RunContext context(1);
  Volume whole = volume_;
  const ColorFitRecord of_all = fit(whole);
  const ColorFitRecord of_cut = fit_colors(
      dataset_, cut, scene_, nullptr, context, [](double) {}, volume_);
  EXPECT_LT(of_cut.pixels, 0.8 * of_all.pixels);
  EXPECT_LT(error(volume_.fitted_color), 0.05);
}

TEST_F(PaintedWall, PhotographsThatAreExplainedChangeNothing) {
  scene_.background.kind = BackgroundKind::kUnknown;
  const PhotographLoader exact = [this](const View&) {
    Photograph photo;
    photo.rgb = Image(pixels_, pixels_, 3);
    return photo;
  };
  std::fill(volume_.color_mean.begin(), volume_.color_mean.end(), Rgb{0, 0, 0});
  const RunContext context(1);
  fit_colors(
      dataset_, exact, scene_, nullptr, context, [](double) {}, volume_);
  for (const Rgb& color : volume_.fitted_color)
    for (const float value : color) EXPECT_EQ(value, 0);
}

TEST_F(PaintedWall, WhereNothingIsSeenColoursStay) {
  std::fill(volume_.tau.begin(), volume_.tau.end(), 0.0f);
  const ColorFitRecord record = fit(volume_);
  EXPECT_EQ(record.pixels, 0);
  EXPECT_EQ(record.rounds, 0);
  EXPECT_EQ(volume_.fitted_color, volume_.color_mean);
}

TEST_F(PaintedWall, StopsWhenCancelled) {
  RunContext context(1);
  context.cancel();
  EXPECT_THROW(fit_colors(
                   dataset_, photographs(), scene_, nullptr, context, [](double) {}, volume_),
               Cancelled);
}

}  // namespace
}  // namespace roxel

// How often one image updates a voxel ([Jethwa04] figure 5.4): once or twice with adaptive samples and ray
// weights, far more often near the camera without them.
#include <gtest/gtest.h>

#include <algorithm>

#include "roxel/infer/infer_fixture.h"

namespace roxel {
namespace {

constexpr double kVoxel = 0.05;
constexpr int kSize = 256;

/// A tunnel of voxels from depth 1 to 8 before the camera: near and far differ by a factor of 8.
class Tunnel {
 public:
  Tunnel() {
    Topology topology(LatticeFrame{{-0.4, -0.4, 1}, kVoxel, {2, 2, 18}});
    for (int z = 0; z < 140; ++z)
      for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) topology.insert({x, y, z});
    volume_ = Volume({topology});
    camera_.intrinsics = {kSize, kSize, 240, 240, kSize / 2, kSize / 2, 0};
  }

  SampleView view(bool adaptive, double samples_per_voxel) const {
    SamplePlanOptions options;
    options.adaptive = adaptive;
    options.samples_per_voxel = samples_per_voxel;
    const Eigen::AlignedBox3d seen(Eigen::Vector3d(-0.4, -0.4, 1), Eigen::Vector3d(0.4, 0.4, 8));
    const SamplePlan plan = make_sample_plan(camera_, seen, kVoxel, {0.5, 8.2}, options);
    return fixture::view_of(camera_, fixture::plain_image(kSize, {50, 0, 0}), plan);
  }

  const Volume& volume() const { return volume_; }
  /// Middle of the voxel in depth.
  double depth(std::uint32_t slot) const { return depths().at(slot); }

 private:
  const std::vector<double>& depths() const {
    if (!depths_.empty()) return depths_;
    depths_.resize(volume_.slot_count());
    for (int z = 0; z < 140; ++z)
      for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) depths_[fixture::slot_at(volume_, x, y, z)] = 1 + kVoxel * (z + 0.5);
    return depths_;
  }

  Volume volume_;
  PinholeCamera camera_;
  mutable std::vector<double> depths_;
};

/// Samples that update each voxel, each counted by its ray weight.
class UpdateCounter {
 public:
  UpdateCounter(const Volume& volume, const SampleView& view)
      : stack_(volume), view_(view), weighted(volume.slot_count(), 0.0) {
    const int level = view.plan.root_level;
    for (int y = 0; y < view.pyramid->height(level); ++y)
      for (int x = 0; x < view.pyramid->width(level); ++x) count({level, x, y}, view.plan.range.begin);
  }

 private:
  void count(const Region& region, double begin) {
    const Stretch range = served_range(view_, region, begin);
    if (range.end > range.begin)
      stack_.walk(
          region_ray(view_, region), range, [](std::uint32_t) {},
          [&](const VoxelStep& step, const VoxelPlace&) {
            weighted[step.slot] += step.weight;
            ++steps;
            return true;
          });
    if (range.end >= view_.plan.range.end) return;
    for (int c = 0; c < 4; ++c)
      if (inside(view_, region.child(c))) count(region.child(c), std::max(range.begin, range.end));
  }

  LatticeStack stack_;
  const SampleView& view_;

 public:
  std::vector<double> weighted;
  std::int64_t steps = 0;
};

double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * (values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Mean count over voxels between two depths.
double mean_between(const Tunnel& tunnel, const UpdateCounter& counter, double begin, double end) {
  double sum = 0;
  int voxels = 0;
  for (std::uint32_t slot = 0; slot < tunnel.volume().slot_count(); ++slot)
    if (tunnel.depth(slot) > begin && tunnel.depth(slot) < end) sum += counter.weighted[slot], ++voxels;
  return sum / voxels;
}

// A sample's diagonal is at most a voxel's side over 0.7, that is, its side about a voxel's where it is
// widest.
TEST(UpdatesPerVoxel, AreNearOneWithAdaptiveSamplesAndRayWeights) {
  const Tunnel tunnel;
  const SampleView view = tunnel.view(true, 0.7);
  ASSERT_EQ(view.plan.root_level - view.plan.finest_level, 3);
  const UpdateCounter counter(tunnel.volume(), view);
  EXPECT_GT(quantile(counter.weighted, 0.01), 0.4);
  EXPECT_GT(quantile(counter.weighted, 0.1), 0.6);
  EXPECT_NEAR(quantile(counter.weighted, 0.5), 1.2, 0.3);
  EXPECT_LT(quantile(counter.weighted, 0.9), 2.5);
  EXPECT_LT(quantile(counter.weighted, 1), 4);
}

TEST(UpdatesPerVoxel, WithoutAdaptiveSamplesNearVoxelsGetTheSquareOfTheDepthRatio) {
  const Tunnel tunnel;
  const UpdateCounter fixed(tunnel.volume(), tunnel.view(false, 0.7));
  const UpdateCounter adaptive(tunnel.volume(), tunnel.view(true, 0.7));
  // Depths 1.5 and 7: (7 / 1.5)^2 = 22.
  const double ratio = mean_between(tunnel, fixed, 1.4, 1.6) / mean_between(tunnel, fixed, 6.9, 7.1);
  EXPECT_NEAR(ratio, 22, 3);
  EXPECT_GT(quantile(fixed.weighted, 1), 50);
  // A division multiplies samples by four, so adaptive counts stay within that of each other.
  const double adaptive_ratio = mean_between(tunnel, adaptive, 1, 2) / mean_between(tunnel, adaptive, 6, 8);
  EXPECT_GT(adaptive_ratio, 0.25);
  EXPECT_LT(adaptive_ratio, 4);
  EXPECT_LT(3 * adaptive.steps, fixed.steps);
}

TEST(UpdatesPerVoxel, GrowWithTheSquareOfSamplesPerVoxel) {
  const Tunnel tunnel;
  const UpdateCounter one(tunnel.volume(), tunnel.view(true, 0.35));
  const UpdateCounter two(tunnel.volume(), tunnel.view(true, 0.7));
  double sums[2] = {0, 0};
  for (const double count : one.weighted) sums[0] += count;
  for (const double count : two.weighted) sums[1] += count;
  EXPECT_NEAR(sums[1] / sums[0], 4, 0.4);
}

TEST(UpdatesPerVoxel, AreWhatTheColourPassDoes) {
  const Tunnel tunnel;
  const SampleView view = tunnel.view(true, 0.7);
  const UpdateCounter counter(tunnel.volume(), view);
  const LatticeStack stack(tunnel.volume());
  NodeScratch scratch(stack, tunnel.volume().tau);
  const PassCounts counts = march_color(stack, {view}, {}, true, RunContext(1), scratch);
  EXPECT_EQ(counts.steps, counter.steps);
}

}  // namespace
}  // namespace roxel

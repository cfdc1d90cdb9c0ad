#pragma once
/// What [Jethwa04] figure 5.4 counts: how often the samples of one image update each voxel.

#include "roxel/infer/infer_fixture.h"

namespace roxel::fixture {

/// A tunnel of voxels from depth 1 to 8 before the camera: near and far differ by a factor of 8.
class Tunnel {
 public:
  static constexpr double kVoxel = 0.05;
  static constexpr int kSize = 256;

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
    return view_of(camera_, plain_image(kSize, {50, 0, 0}), plan);
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
        for (int x = 0; x < 16; ++x) depths_[slot_at(volume_, x, y, z)] = 1 + kVoxel * (z + 0.5);
    return depths_;
  }

  Volume volume_;
  PinholeCamera camera_;
  mutable std::vector<double> depths_;
};

/// Samples that update each voxel, and the same counted by their ray weights.
class UpdateCounter {
 public:
  UpdateCounter(const Volume& volume, const SampleView& view)
      : stack_(volume), view_(view), plain(volume.slot_count(), 0.0), weighted(volume.slot_count(), 0.0) {
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
            plain[step.slot] += 1;
            weighted[step.slot] += step.weight;
            ++(step.length > kSliver ? steps : slivers);
            return true;
          });
    if (range.end >= view_.plan.range.end) return;
    for (int c = 0; c < 4; ++c)
      if (inside(view_, region.child(c))) count(region.child(c), std::max(range.begin, range.end));
  }

  /// Shorter chords are where a ray but touches a voxel, voxel lengths: one walk finds them, another does
  /// not.
  static constexpr float kSliver = 1e-6f;

  LatticeStack stack_;
  const SampleView& view_;

 public:
  std::vector<double> plain, weighted;
  std::int64_t steps = 0, slivers = 0;
};

}  // namespace roxel::fixture

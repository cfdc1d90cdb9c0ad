#pragma once
/// The colour march, several samples at a time: gives each sample to the voxels along its ray.

#include <vector>

#include "roxel/infer/packet_levels.h"
#include "roxel/infer/passes.h"

namespace roxel {

/// What a packet's samples give, and how much of each ray gets as far.
struct alignas(64) ColorLanes {
  // Of a sample, in the order of VoxelScratch: mean and second moments xx .. xz; then yz and 1.
  float low[kMaxPacketRays][8] = {};
  float high[kMaxPacketRays][4] = {};
  float weight[kMaxPacketRays] = {};  ///< what a whole sample counts
  float transmittance[kMaxPacketRays] = {};

  void set(int ray, const RegionStats& sample, float weight, float transmittance);
};

/// Transmittance below which what lies behind is not coloured. The roxels rule gives hidden voxels opacity as
/// well, so that their colours count for more.
constexpr float spent_transmittance(UpdateRule rule) { return rule == UpdateRule::kRoxels ? 1e-5f : 1e-3f; }
inline constexpr float kLeastColorWeight = 1e-6f;  ///< weights that cannot matter against evidence_half
/// What a region's sample counts for colour: its observation weight, as far as it shows no known background.
float color_weight(const SampleView& view, const Region& region, const RegionStats& sample,
                   const MarchOptions& options);

class ColorPackets {
 public:
  ColorPackets(const LatticeStack& stack, const MarchOptions& options, bool everywhere, NodeScratch& scratch)
      : options_(options),
        everywhere_(everywhere),
        spent_(spent_transmittance(options.rule)),
        scratch_(scratch),
        walk_(stack) {}

  /// Adds what the tile's samples give to the scratch's voxels.
  void tile(const ListedView& listed, const Tile& tile);

  PassCounts counts;

 private:
  struct Sample {
    Region region;
    float transmittance;  ///< as far as its stretch, then behind it
  };

  template <class March>
  friend void march_tile(March& march, const ListedView& listed, const Tile& tile);
  const std::vector<Sample>& samples() const { return samples_; }
  void add(const SampleView& view, const Region& region, int parent);
  void begin(const Eigen::Vector3d& origin, Stretch range, std::span<const std::uint32_t> bricks) {
    walk_.begin(origin, range, bricks);
  }
  void add_ray(int ray, const Eigen::Vector3d& direction) { walk_.add(ray, direction); }
  void march(const SampleView& view, const SamplePacket& packet);
  bool divides(const SampleView& view, std::size_t sample, bool last) const;
  void divided(std::size_t, std::size_t, std::size_t) {}
  void nothing_behind(const SampleView&, std::size_t) {}
  void level_done(std::size_t) {}
  bool goes_on(float transmittance) const { return everywhere_ || transmittance >= spent_; }
  void deposit(ColorLanes& lanes);

  const MarchOptions& options_;
  bool everywhere_;
  float spent_;
  NodeScratch& scratch_;
  PacketWalk walk_;
  PacketSteps steps_;
  std::vector<Sample> samples_;
};

}  // namespace roxel

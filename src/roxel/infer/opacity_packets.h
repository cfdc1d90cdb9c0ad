#pragma once
/// The opacity march of the posterior rule without filters, several samples at a time. A tile's samples
/// divide level by level, so that the samples of a packet are neighbours of one size.

#include <vector>

#include "roxel/infer/packet_levels.h"
#include "roxel/infer/packet_march.h"
#include "roxel/infer/passes.h"

namespace roxel {

class OpacityPackets {
 public:
  OpacityPackets(const LatticeStack& stack, const MarchOptions& options, NodeScratch& scratch)
      : options_(options), march_(stack, scratch, options.model) {}
  /// Whether the options are such that this march serves.
  static bool serves(const MarchOptions& options);

  /// Adds what the tile's root samples say to the scratch's voxels.
  void tile(const ListedView& listed, const Tile& tile);

  PassCounts counts;

 private:
  /// One sample of a tile; those that it divides into are samples_[first_child, end_child).
  struct Sample {
    Region region;
    float weight;       ///< observation weight
    Segment own = {};   ///< of its stretch
    float behind = 0;   ///< leaves: p_bg; others: product of Z_c^{share}
    float z = 0;        ///< of its own stretch and what is behind it
    float reach = 0;    ///< probability of getting as far as its stretch
    bool ends = false;  ///< nothing is behind but background
    int first_child = 0, end_child = 0;
  };
  /// Samples that were marched together, and their steps.
  struct Packet : SamplePacket {
    std::size_t first_step, end_step;
  };
  /// Samples and packets of one pyramid level.
  struct Level {
    std::size_t end_sample, end_packet;
  };

  template <class March>
  friend void march_tile(March& march, const ListedView& listed, const Tile& tile);
  const std::vector<Sample>& samples() const { return samples_; }
  void add(const SampleView& view, const Region& region, int parent);
  void begin(const Eigen::Vector3d& origin, Stretch range, std::span<const std::uint32_t> bricks) {
    march_.begin(origin, range, bricks);
  }
  void add_ray(int ray, const Eigen::Vector3d& direction) { march_.add(ray, direction); }
  void march(const SampleView& view, const SamplePacket& packet);
  bool divides(const SampleView& view, std::size_t sample, bool last);
  void divided(std::size_t sample, std::size_t first_child, std::size_t end_child);
  void nothing_behind(const SampleView& view, std::size_t sample);
  void level_done(std::size_t end_sample) { levels_.push_back({end_sample, packets_.size()}); }

  static RegionStats stats_of(const SampleView& view, const Sample& sample) {
    return view.pyramid->at(sample.region.level, sample.region.x, sample.region.y);
  }
  void count_background(const SampleView& view, const Tile& tile);
  void look_behind(const SampleView& view);
  void distribute();
  void give_out(const Packet& packet);
  void hand_on(const Sample& sample);

  const MarchOptions& options_;
  PacketMarch march_;
  std::vector<Sample> samples_;
  std::size_t roots_ = 0;  ///< samples that are nobody's children: the first ones
  std::vector<Packet> packets_;
  std::vector<Level> levels_;
  PacketRecord record_;
};

}  // namespace roxel

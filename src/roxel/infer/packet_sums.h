#pragma once
/// The inner loops of the packet marches, written once for vectors of any width (as packet_kernels.h).

#include "roxel/infer/evidence.h"
#include "roxel/infer/match.h"
#include "roxel/march/packet_steps.h"

namespace roxel {

/// The terms of the samples of a packet's rays.
struct alignas(64) PacketTerms {
  float mean[3][kMaxPacketRays] = {};
  float cov_plus_noise[6][kMaxPacketRays] = {};
  float foreground[kMaxPacketRays] = {};

  void set(int ray, const SampleTerms& sample);
};

/// What a packet's rays have met so far, in ray order from where they began: (T, Z) of each.
struct alignas(64) PacketSegments {
  float transmittance[kMaxPacketRays];
  float likelihood[kMaxPacketRays];

  PacketSegments();
};

/// What a ray says about the voxels on its way, without its likelihood as a whole: responsibilities follow
/// once that is known.
class PacketRecord {
 public:
  PacketRecord() = default;
  std::size_t size() const { return size_; }
  void clear() { size_ = 0; }
  /// Room for so many more steps, and for whole vectors behind them; returns where they begin.
  std::size_t append(std::size_t count);

  // Columns of size() entries, valid until append.
  std::uint32_t* slot() { return slots_.get(); }
  std::int32_t* ray() { return rays_.get(); }
  float* share() { return column(0); }      ///< T a p, T from where the ray began
  float* before() { return column(1); }     ///< sum of the shares of the ray's steps before this one
  float* length() { return column(2); }     ///< chord
  float* mean_path() { return column(3); }  ///< e
  float* weight() { return column(4); }     ///< ray weight

 private:
  static constexpr int kColumns = 5;
  float* column(int which) { return columns_.get() + which * capacity_; }

  std::size_t size_ = 0, capacity_ = 0;
  std::unique_ptr<std::uint32_t[]> slots_;
  std::unique_ptr<std::int32_t[]> rays_;
  std::unique_ptr<float[]> columns_;
};

/// Probabilities of a packet's rays while they are given out.
struct alignas(64) PacketReach {
  float reach[kMaxPacketRays] = {};   ///< of getting as far as the first step
  float scale[kMaxPacketRays] = {};   ///< reach / Z; rays with 0 give nothing
  float weight[kMaxPacketRays] = {};  ///< observation weight
};

/// Brings each step's sample into a block that holds voxels (gather_voxels).
void bring_in_samples(const PacketTerms& samples, const PacketSteps& steps, MatchBlock& block);
/// Appends a brick's evaluated steps to each ray's segment, and writes their shares and what was before them.
void fold_steps(const PacketSteps& steps, const MatchBlock& block, PacketSegments& segments, float* share,
                float* before);
/// Of each step: a x transmittance x ray weight x the ray's weight, for opacities a, or 1 for a x
/// transmittance where `opacity` is null. The rays' transmittance goes on behind the steps.
void color_shares(const PacketSteps& steps, const float* opacity, const float* weight, float* transmittance,
                  float* share);
/// Gives each ray's reach out to the voxels of steps [begin, end): hits, exposure and looked.
void give_out_reach(PacketRecord& record, std::size_t begin, std::size_t end, bool ray_weights,
                    const PacketReach& rays, VoxelScratch* voxels);

}  // namespace roxel

// Everything is summed in doubles as raw moments (w, w mu, w (Sigma + mu mu^T)), so that the order of the
// volumes matters only to the last bit.
#include "roxel/volume/merge.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"

namespace roxel {
namespace {

// Voxel planes coincide when origins differ by whole voxels, within this part of one.
constexpr double kAlignment = 1e-3;
constexpr double kLargestTau = 16;    // as tau_from_alpha
constexpr double kFewestHits = 1e-3;  // below, the Roxels rule has nothing to divide by
constexpr double kMaxConfidence = 1 - 1e-7;

// Where one volume's lattice lies in the merged one: voxel ijk there is ijk - offset here.
struct Source {
  const Volume* volume;
  const BrickIndex* index;
  Eigen::Vector3i offset;
};

Eigen::Vector3i offset_in_voxels(const LatticeFrame& from, const LatticeFrame& to, int volume_number) {
  const std::string where = "merge: volume " + std::to_string(volume_number);
  if (std::abs(to.voxel_size / from.voxel_size - 1) > 1e-9)
    throw_invalid(where, "voxel size " + std::to_string(to.voxel_size),
                  std::to_string(from.voxel_size) + " as in volume 1");
  const Eigen::Array3d offset = (to.origin - from.origin) / from.voxel_size;
  const double error = (offset - offset.round()).abs().maxCoeff();
  if (!(error <= kAlignment) || !(offset.abs() < 1e9).all())
    throw_invalid(where, "voxel planes shifted by " + std::to_string(error) + " voxels",
                  "those of volume 1 (boxes that differ by whole voxels)");
  return offset.round().cast<int>();
}

bool same(const LatticeFrame& a, const LatticeFrame& b) {
  return a.size_in_bricks == b.size_in_bricks && offset_in_voxels(a, b, 0).isZero();
}

// The union of the boxes of lattice 0, in the brick planes of the first.
LatticeFrame union_frame(const std::vector<const Volume*>& volumes) {
  LatticeFrame frame = volumes.front()->index(0).frame();
  Eigen::Vector3i lo = Eigen::Vector3i::Zero(), hi = frame.size_in_voxels();
  for (std::size_t i = 1; i < volumes.size(); ++i) {
    const LatticeFrame& other = volumes[i]->index(0).frame();
    const Eigen::Vector3i offset = offset_in_voxels(frame, other, static_cast<int>(i) + 1);
    lo = lo.cwiseMin(offset);
    hi = hi.cwiseMax(offset + other.size_in_voxels());
  }
  const Eigen::Vector3d first = (lo.cast<double>() / kBrickSide).array().floor().matrix();
  const Eigen::Vector3d last = (hi.cast<double>() / kBrickSide).array().ceil().matrix();
  frame.origin += frame.voxel_size * kBrickSide * first;
  frame.size_in_bricks = (last - first).cast<int>();
  if (frame.size_in_bricks.cast<double>().prod() > 1 << 28)
    throw_invalid("merge", "a union of more than 2^28 bricks", "boxes closer to each other");
  return frame;
}

// The lattices that the result has: all where the boxes are the same, else only the box.
std::vector<LatticeFrame> merged_frames(const std::vector<const Volume*>& volumes) {
  std::vector<LatticeFrame> frames{union_frame(volumes)};
  const Volume* largest = volumes.front();
  for (const Volume* volume : volumes) {
    if (!same(frames[0], volume->index(0).frame())) return frames;
    if (volume->lattice_count() > largest->lattice_count()) largest = volume;
  }
  for (int k = 1; k < largest->lattice_count(); ++k) frames.push_back(largest->index(k).frame());
  return frames;
}

std::vector<Source> sources_of(const std::vector<const Volume*>& volumes, const LatticeFrame& frame,
                               int lattice) {
  std::vector<Source> sources;
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    if (lattice >= volumes[i]->lattice_count()) continue;
    const BrickIndex& index = volumes[i]->index(lattice);
    sources.push_back({volumes[i], &index, offset_in_voxels(frame, index.frame(), static_cast<int>(i) + 1)});
  }
  return sources;
}

Topology union_of(const std::vector<Source>& sources, const LatticeFrame& frame) {
  Topology topology(frame);
  for (const Source& source : sources) {
    const bool on_brick_planes = source.offset.unaryExpr([](int x) { return x % kBrickSide; }).isZero();
    for (const Brick& brick : source.index->bricks()) {
      BrickMask mask;
      brick.for_each_voxel([&](int v, std::uint32_t) { mask.set(v); });
      if (on_brick_planes)
        topology.insert_brick(brick.coord + source.offset / kBrickSide, mask);
      else
        for (int v = 0; v < kBrickVoxels; ++v)
          if (mask[v]) topology.insert(voxel_of(brick, v) + source.offset);
    }
  }
  return topology;
}

// The evidence about one voxel, summed over the volumes that have it.
class Evidence {
 public:
  explicit Evidence(const MergeOptions& options) : options_(options) {}

  void add(const Volume& v, std::uint32_t slot) {
    ++count_;
    add_color(v, slot);
    hits_ += v.support[slot][0];
    exposure_ += v.support[slot][1];
    looked_ += 2.0 * v.confidence[slot] / (1.0 - std::min<double>(v.confidence[slot], kMaxConfidence));
    prior_tau_ += prior_in(v, slot);
  }

  void store(Volume& v, std::uint32_t slot) const {
    v.tau[slot] = static_cast<float>(std::clamp(tau(), 0.0, kLargestTau));
    v.support[slot] = {static_cast<float>(hits_), static_cast<float>(exposure_)};
    v.confidence[slot] = static_cast<float>(std::min(looked_ / (looked_ + 2), kMaxConfidence));
    if (weight_ > 0) store_color(v, slot);
  }

 private:
  static constexpr int kRow[6] = {0, 1, 2, 0, 0, 1}, kColumn[6] = {0, 1, 2, 1, 2, 2};

  void add_color(const Volume& v, std::uint32_t slot) {
    const double w = v.color_weight[slot];
    const auto& mu = v.color_mean[slot];
    weight_ += w;
    for (int i = 0; i < 3; ++i) mean_[i] += w * mu[i];
    const std::array<float, 6> cov = v.color_cov[slot].unpacked();
    for (int c = 0; c < 6; ++c)
      moment_[c] += w * (cov[c] + static_cast<double>(mu[kRow[c]]) * mu[kColumn[c]]);
  }

  void store_color(Volume& v, std::uint32_t slot) const {
    v.color_weight[slot] = static_cast<float>(weight_);
    double mu[3];
    for (int i = 0; i < 3; ++i) v.color_mean[slot][i] = static_cast<float>(mu[i] = mean_[i] / weight_);
    std::array<float, 6> cov;
    for (int c = 0; c < 6; ++c)
      cov[c] = static_cast<float>(moment_[c] / weight_ - mu[kRow[c]] * mu[kColumn[c]]);
    v.color_cov[slot] = PackedCovariance(cov);
  }

  // Solves the update rule for the prior that, with this volume's support, gave its tau.
  double prior_in(const Volume& v, std::uint32_t slot) const {
    const double beta = options_.prior_strength, tau = v.tau[slot];
    if (options_.rule == SupportRule::kRoxels || !(beta > 0)) return tau;
    return std::clamp((tau * (v.support[slot][1] + beta) - v.support[slot][0]) / beta, 0.0, kLargestTau);
  }

  double tau() const {
    const double tau_0 = options_.prior_opacity ? -std::log1p(-*options_.prior_opacity) : prior_tau_ / count_;
    if (options_.rule == SupportRule::kRoxels)
      return hits_ > kFewestHits ? tau_from_alpha(static_cast<float>(exposure_ / hits_)) : tau_0;
    const double beta = options_.prior_strength;
    return exposure_ + beta > 0 ? (hits_ + beta * tau_0) / (exposure_ + beta) : tau_0;
  }

  const MergeOptions& options_;
  int count_ = 0;
  double weight_ = 0, mean_[3] = {}, moment_[6] = {};
  double hits_ = 0, exposure_ = 0, looked_ = 0, prior_tau_ = 0;
};

void copy_voxel(const Volume& from, std::uint32_t s, Volume& to, std::uint32_t t) {
  to.tau[t] = from.tau[s];
  to.confidence[t] = from.confidence[s];
  to.color_weight[t] = from.color_weight[s];
  to.color_mean[t] = from.color_mean[s];
  to.color_cov[t] = from.color_cov[s];
  to.support[t] = from.support[s];
}

void fill_brick(const std::vector<Source>& sources, const Brick& brick, const MergeOptions& options,
                Volume& merged) {
  brick.for_each_voxel([&](int v, std::uint32_t slot) {
    Evidence evidence(options);
    int found = 0;
    for (const Source& source : sources) {
      const std::uint32_t from = source.index->slot(voxel_of(brick, v) - source.offset);
      if (from == kNoSlot) continue;
      if (++found == 1) copy_voxel(*source.volume, from, merged, slot);
      evidence.add(*source.volume, from);
    }
    if (found > 1) evidence.store(merged, slot);
  });
}

}  // namespace

Volume merge(const std::vector<const Volume*>& volumes, const MergeOptions& options, int threads) {
  std::vector<const Volume*> present;
  for (const Volume* volume : volumes)
    if (volume->lattice_count() > 0) present.push_back(volume);
  if (present.empty()) return Volume();

  std::vector<std::vector<Source>> sources;
  std::vector<Topology> lattices;
  for (const LatticeFrame& frame : merged_frames(present)) {
    sources.push_back(sources_of(present, frame, static_cast<int>(sources.size())));
    lattices.push_back(union_of(sources.back(), frame));
  }
  Volume merged(std::move(lattices));
  for (int k = 0; k < merged.lattice_count(); ++k) {
    const std::vector<Brick>& bricks = merged.index(k).bricks();
    parallel_for_blocks(bricks.size(), 64, threads, [&](std::int64_t begin, std::int64_t end, int) {
      for (std::int64_t b = begin; b < end; ++b) fill_brick(sources[k], bricks[b], options, merged);
    });
  }
  return merged;
}

}  // namespace roxel

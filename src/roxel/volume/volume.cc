#include "roxel/volume/volume.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"

namespace roxel {
namespace {

// exp(-16) is 1e-7, the last opacity below 1 that a float can tell from 1.
constexpr float kMaxTau = 16.0f;

// A side of n voxels that should be whole is not grown by rounding of its ends.
constexpr double kWholeTolerance = 1e-6;

std::string text(const Eigen::AlignedBox3d& box) {
  std::ostringstream out;
  out << box.min().transpose() << " to " << box.max().transpose();
  return out.str();
}

Eigen::Vector3i bricks_to_cover(const Eigen::AlignedBox3d& bounds, double voxel_size, int multiple) {
  const double step = voxel_size * kBrickSide * multiple;
  const Eigen::Array3d steps = (bounds.sizes().array() / step - kWholeTolerance).ceil().max(1.0);
  if (!(steps.prod() * multiple * multiple * multiple <= kMaxBricks)) {
    std::ostringstream found;
    found << "voxel size " << voxel_size << " in bounds " << text(bounds);
    throw_invalid("volume", found.str(),
                  "at most 2^28 bricks of 8^3 voxels; use larger voxels or a smaller box");
  }
  return multiple * steps.cast<int>();
}

void check_bounds(const Eigen::AlignedBox3d& bounds, double voxel_size) {
  if (!(std::isfinite(voxel_size) && voxel_size > 0))
    throw_invalid("volume", "voxel size " + std::to_string(voxel_size), "a positive number");
  const bool finite = bounds.min().allFinite() && bounds.max().allFinite();
  if (!finite || !(bounds.sizes().array() > 0).all())
    throw_invalid("volume", "bounds " + text(bounds), "finite numbers, each minimum below its maximum");
}

/// Fills all but the brick's first slot.
void set_voxels(const BrickVoxels& found, Brick& brick) {
  brick.coord = found.brick;
  const BrickMask low(0xffffffffu);
  for (std::size_t w = 0; w < brick.word.size(); ++w)
    brick.word[w] = static_cast<std::uint32_t>((found.mask >> 32 * w & low).to_ulong());
  brick.before[0] = 0;
  for (std::size_t w = 1; w < brick.word.size(); ++w)
    brick.before[w] = static_cast<std::uint16_t>(brick.before[w - 1] + std::popcount(brick.word[w - 1]));
}

}  // namespace

Eigen::AlignedBox3d LatticeFrame::box() const {
  return {origin, origin + voxel_size * size_in_voxels().cast<double>()};
}

BrickIndex::BrickIndex(const Topology& topology, std::uint32_t first_slot, int threads)
    : frame_(topology.frame()), first_slot_(first_slot) {
  const std::int64_t voxels = topology.voxel_count();
  if (voxels >= static_cast<std::int64_t>(kNoSlot) - first_slot)
    throw_invalid("volume", std::to_string(voxels) + " voxels", "fewer than 2^32 in all lattices");
  slot_count_ = static_cast<std::uint32_t>(voxels);
  const std::vector<BrickVoxels> found = topology.bricks(threads);
  bricks_.resize(found.size());
  const Eigen::Vector3i n = frame_.size_in_bricks;
  table_.assign(static_cast<std::size_t>(n.x()) * n.y() * n.z(), -1);
  std::uint32_t next = first_slot_;
  for (std::size_t b = 0; b < found.size(); ++b) {
    const Eigen::Vector3i& at = found[b].brick;
    table_[at.x() + static_cast<std::size_t>(n.x()) * (at.y() + static_cast<std::size_t>(n.y()) * at.z())] =
        static_cast<std::int32_t>(b);
    bricks_[b].first_slot = next;
    next += static_cast<std::uint32_t>(found[b].mask.count());
  }
  parallel_for_blocks(found.size(), 256, threads, [&](std::int64_t begin, std::int64_t end, int) {
    for (std::int64_t b = begin; b < end; ++b) set_voxels(found[b], bricks_[b]);
  });
}

std::uint32_t BrickIndex::slot(const Eigen::Vector3i& ijk) const {
  if ((ijk.array() < 0).any() || (ijk.array() >= frame_.size_in_voxels().array()).any()) return kNoSlot;
  const std::int32_t brick_idx = brick_at(ijk.x() / kBrickSide, ijk.y() / kBrickSide, ijk.z() / kBrickSide);
  if (brick_idx < 0) return kNoSlot;
  const Brick& brick = bricks_[brick_idx];
  const int v = voxel_in_brick(ijk.x() % kBrickSide, ijk.y() % kBrickSide, ijk.z() % kBrickSide);
  return brick.has(v) ? brick.slot(v) : kNoSlot;
}

std::vector<LatticeFrame> nested_frames(const Eigen::AlignedBox3d& bounds, double voxel_size,
                                        int surround_count) {
  check_bounds(bounds, voxel_size);
  // Lattice k-1 takes the middle half of lattice k, so it starts a quarter of the side inside it: on a brick
  // plane where the side is a multiple of 4 bricks.
  const Eigen::Vector3i size = bricks_to_cover(bounds, voxel_size, surround_count > 0 ? 4 : 1);
  const Eigen::Vector3d half_side = 0.5 * voxel_size * kBrickSide * size.cast<double>();
  const Eigen::Vector3d first_origin = bounds.center() - half_side;
  std::vector<LatticeFrame> frames;
  for (int k = 0; k <= surround_count; ++k)
    frames.push_back(
        {first_origin - (std::ldexp(1.0, k) - 1.0) * half_side, std::ldexp(voxel_size, k), size});
  return frames;
}

Volume::Volume(std::vector<Topology> lattices, int threads) : topologies_(std::move(lattices)) {
  indices_.reserve(topologies_.size());
  for (const Topology& topology : topologies_) {
    indices_.emplace_back(topology, slot_count_, threads);
    slot_count_ += indices_.back().slot_count();
  }
  resize_channels(threads);
}

std::uint32_t Volume::box_slot_count() const { return indices_.empty() ? 0 : indices_.front().slot_count(); }

void Volume::resize_channels(int threads) {
  // Most of the time goes by as the system hands out pages, one channel at a time a thread.
  const std::array<std::function<void()>, 6> resize = {
      [this] { color_cov.resize(slot_count_); },  [this] { color_mean.resize(slot_count_); },
      [this] { support.resize(slot_count_); },    [this] { tau.resize(slot_count_); },
      [this] { confidence.resize(slot_count_); }, [this] { color_weight.resize(slot_count_); }};
  parallel_for(resize.size(), threads, [&](std::int64_t i, int) { resize[i](); });
}

float alpha_from_tau(float tau) { return -std::expm1(-std::clamp(tau, 0.0f, kMaxTau)); }

float tau_from_alpha(float alpha) {
  return alpha >= 1.0f ? kMaxTau : std::clamp(-std::log1p(-alpha), 0.0f, kMaxTau);
}

}  // namespace roxel

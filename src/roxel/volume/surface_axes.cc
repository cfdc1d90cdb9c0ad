#include "roxel/volume/surface_axes.h"

#include <Eigen/Eigenvalues>
#include <array>

#include "roxel/base/parallel.h"
#include "roxel/volume/neighbours.h"

namespace roxel {
namespace {

constexpr std::int64_t kGrain = 16;  ///< bricks

using Channel = std::vector<float>;

/// Calls visit(slot, centre) for every voxel of a brick; `centre` points at it in the gathered block.
template <class Visit>
void for_each_voxel(const BrickIndex& index, const Channel& channel, int brick_idx, Visit&& visit) {
  float block[kBlockVoxels];
  gather_block(index, channel.data(), brick_idx, 0.0f, block);
  const Brick& brick = index.bricks()[brick_idx];
  brick.for_each_voxel(
      [&](int v, std::uint32_t slot) { visit(slot, block + voxel_in_block(v % 8, v / 8 % 8, v / 64)); });
}

template <class Visit>
void for_each_brick(const BrickIndex& index, int threads, Visit&& visit) {
  parallel_for_blocks(static_cast<std::int64_t>(index.bricks().size()), kGrain, threads,
                      [&](std::int64_t begin, std::int64_t end, int) {
                        for (std::int64_t b = begin; b < end; ++b) visit(static_cast<int>(b));
                      });
}

/// Binomial weights (1, 2, 1) along each axis; absent voxels are 0.
Channel blurred(const BrickIndex& index, const Channel& channel, int threads) {
  Channel out(channel.size());
  for_each_brick(index, threads, [&](int b) {
    for_each_voxel(index, channel, b, [&](std::uint32_t slot, const float* centre) {
      float sum = 0;
      for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j)
          for (int i = -1; i <= 1; ++i)
            sum += static_cast<float>((2 - std::abs(i)) * (2 - std::abs(j)) * (2 - std::abs(k))) *
                   centre[i + kBlockSide * (j + kBlockSide * k)];
      out[slot] = sum / 64;
    });
  });
  return out;
}

/// Outer products of the gradient: xx, yy, zz, xy, xz, yz.
std::array<Channel, 6> gradient_products(const BrickIndex& index, const Channel& opacity, int threads) {
  std::array<Channel, 6> products;
  for (Channel& product : products) product.resize(opacity.size());
  for_each_brick(index, threads, [&](int b) {
    for_each_voxel(index, opacity, b, [&](std::uint32_t slot, const float* centre) {
      constexpr int kStep[3] = {1, kBlockSide, kBlockSide * kBlockSide};
      float g[3];
      for (int a = 0; a < 3; ++a) g[a] = centre[kStep[a]] - centre[-kStep[a]];
      for (int a = 0; a < 3; ++a) products[a][slot] = g[a] * g[a];
      products[3][slot] = g[0] * g[1];
      products[4][slot] = g[0] * g[2];
      products[5][slot] = g[1] * g[2];
    });
  });
  return products;
}

Eigen::Vector3f first_axis(const std::array<Channel, 6>& t, std::uint32_t slot) {
  Eigen::Matrix3f tensor;
  tensor << t[0][slot], t[3][slot], t[4][slot],  //
      t[3][slot], t[1][slot], t[5][slot],        //
      t[4][slot], t[5][slot], t[2][slot];
  if (!(tensor.trace() > 0)) return Eigen::Vector3f::Zero();
  tensor /= tensor.trace();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> axes(tensor);
  return axes.eigenvectors().col(2);
}

}  // namespace

std::vector<Eigen::Vector3f> surface_axes(const Volume& volume, int threads) {
  const BrickIndex& index = volume.index(0);
  Channel opacity(volume.slot_count());
  for (std::uint32_t slot = 0; slot < opacity.size(); ++slot)
    opacity[slot] = alpha_from_tau(volume.tau[slot]);
  std::array<Channel, 6> tensor = gradient_products(index, blurred(index, opacity, threads), threads);
  for (Channel& channel : tensor) channel = blurred(index, blurred(index, channel, threads), threads);
  std::vector<Eigen::Vector3f> axes(volume.box_slot_count(), Eigen::Vector3f::Zero());
  for_each_brick(index, threads, [&](int b) {
    const Brick& brick = index.bricks()[b];
    for (std::uint32_t slot = brick.first_slot; slot < brick.first_slot + brick.count(); ++slot)
      axes[slot] = first_axis(tensor, slot);
  });
  return axes;
}

}  // namespace roxel

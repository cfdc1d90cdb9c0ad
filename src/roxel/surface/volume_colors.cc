#include "roxel/surface/volume_colors.h"

#include <algorithm>
#include <cmath>

#include "roxel/base/parallel.h"

namespace roxel {
namespace {

constexpr int kReach = 2;          ///< voxels
constexpr double kNearness = 0.7;  ///< sigma of the weight by distance, voxels
constexpr std::int64_t kColorGrain = 1024;

class ColorOfPoint {
 public:
  ColorOfPoint(const Volume& volume, const ColorTransform& colors)
      : volume_(volume), index_(volume.index(0)), colors_(colors) {}

  std::array<float, 3> operator()(const Eigen::Vector3d& x) const {
    const LatticeFrame& frame = index_.frame();
    const Eigen::Vector3d at = (x - frame.origin) / frame.voxel_size;
    const Eigen::Vector3i base = at.array().floor().cast<int>();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weights = 0;
    for (int k = -kReach; k <= kReach; ++k)
      for (int j = -kReach; j <= kReach; ++j)
        for (int i = -kReach; i <= kReach; ++i) {
          const Eigen::Vector3i ijk = base + Eigen::Vector3i(i, j, k);
          const std::uint32_t slot = index_.slot(ijk);
          if (slot == kNoSlot) continue;
          const double away = (ijk.cast<double>() + Eigen::Vector3d::Constant(0.5) - at).norm();
          const double weight = std::exp(-0.5 * away * away / (kNearness * kNearness)) *
                                alpha_from_tau(volume_.tau[slot]) * volume_.color_weight[slot];
          const auto& mean = volume_.color_mean[slot];
          sum += weight * Eigen::Vector3d(mean[0], mean[1], mean[2]);
          weights += weight;
        }
    if (!(weights > 0)) return {0.5f, 0.5f, 0.5f};
    const Eigen::Vector3f mean = (sum / weights).cast<float>();
    std::array<float, 3> rgb{};
    colors_.to_rgb(mean.data(), rgb.data());
    for (float& value : rgb) value = std::max(value, 0.0f);
    return rgb;
  }

 private:
  const Volume& volume_;
  const BrickIndex& index_;
  const ColorTransform& colors_;
};

}  // namespace

std::vector<std::array<float, 3>> volume_colors(const std::vector<Eigen::Vector3d>& points,
                                                const Volume& volume, const ColorTransform& colors,
                                                int threads) {
  const ColorOfPoint color(volume, colors);
  std::vector<std::array<float, 3>> out(points.size());
  parallel_for_blocks(std::ssize(points), kColorGrain, threads,
                      [&](std::int64_t begin, std::int64_t end, int) {
                        for (std::int64_t i = begin; i < end; ++i) out[i] = color(points[i]);
                      });
  return out;
}

}  // namespace roxel

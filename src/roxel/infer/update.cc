#include "roxel/infer/update.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "roxel/base/parallel.h"
#include "roxel/volume/neighbours.h"

namespace roxel {

namespace {

constexpr float kLargestTau = 16;
constexpr std::int64_t kGrain = 1 << 15;

/// The neighbours of a voxel that lie in one plane through it, as offsets in a gathered block.
struct Sheet {
  int count = 0;
  std::array<int, 8> offsets = {};
};

/// One sheet for every plane whose normal n is a voxel's step to a neighbour: the neighbours o with n o = 0.
constexpr std::array<Sheet, 13> sheets() {
  std::array<Sheet, 13> all;
  for (int normal = 0; normal < 13; ++normal) {  // of n and -n, the one that comes first
    const int nx = normal % 3 - 1, ny = normal / 3 % 3 - 1, nz = normal / 9 - 1;
    for (int step = 0; step < 27; ++step) {
      const int x = step % 3 - 1, y = step / 3 % 3 - 1, z = step / 9 - 1;
      if (step != 13 && nx * x + ny * y + nz * z == 0)
        all[normal].offsets[all[normal].count++] = x + kBlockSide * (y + kBlockSide * z);
    }
  }
  return all;
}
constexpr std::array<Sheet, 13> kSheets = sheets();

float sheet_opacity(const float* centre) {
  float best = 0;
  for (const Sheet& sheet : kSheets) {
    float sum = 0;
    for (int k = 0; k < sheet.count; ++k) sum += centre[sheet.offsets[k]];
    best = std::max(best, sum / static_cast<float>(sheet.count));
  }
  return best;
}

/// Drives opacities apart, to both sides of kSharpenedAround.
float sharpened(float opacity, float power) {
  constexpr float kOdds = kSharpenedAround / (1 - kSharpenedAround);
  const float full = std::pow(opacity, power), empty = std::pow(kOdds * (1 - opacity), power);
  return full / (full + empty);
}

void sheet_prior_of_brick(const BrickIndex& index, int brick_idx, const std::vector<float>& opacity,
                          const PriorOptions& prior, std::vector<float>& field) {
  float block[kBlockVoxels];
  gather_block(index, opacity.data(), brick_idx, 0.0f, block);
  const Brick& brick = index.bricks()[brick_idx];
  const float lambda = static_cast<float>(prior.spatial_lambda);
  const float power = static_cast<float>(prior.sharpness);
  const float base = (1 - lambda) * static_cast<float>(prior.opacity);
  brick.for_each_voxel([&](int v, std::uint32_t slot) {
    const float sheet = sheet_opacity(block + voxel_in_block(v % 8, v / 8 % 8, v / 64));
    field[slot] = base + lambda * (power > 1 ? sharpened(sheet, power) : sheet);
  });
}

}  // namespace

std::vector<float> prior_opacity_field(const Volume& volume, const PriorOptions& prior, int threads) {
  std::vector<float> field(volume.slot_count(), static_cast<float>(prior.opacity));
  if (prior.spatial_lambda <= 0) return field;
  std::vector<float> opacity(volume.slot_count());
  parallel_for_blocks(volume.slot_count(), kGrain, threads, [&](std::int64_t begin, std::int64_t end, int) {
    for (std::int64_t slot = begin; slot < end; ++slot) opacity[slot] = alpha_from_tau(volume.tau[slot]);
  });
  for (int k = 0; k < volume.lattice_count(); ++k) {
    const BrickIndex& index = volume.index(k);
    parallel_for_blocks(index.bricks().size(), 64, threads, [&](std::int64_t begin, std::int64_t end, int) {
      for (std::int64_t b = begin; b < end; ++b)
        sheet_prior_of_brick(index, static_cast<int>(b), opacity, prior, field);
    });
  }
  return field;
}

UpdateReport update_opacity(UpdateRule rule, const Totals& totals, const std::vector<float>& prior_opacity,
                            double prior_strength, int threads, Volume& volume, Acceleration* acceleration) {
  struct Sums {
    double change = 0, opacity = 0;
    std::int64_t looked = 0;
  };
  const std::int64_t count = volume.slot_count();
  std::vector<Sums> blocks((count + kGrain - 1) / kGrain);
  parallel_for_blocks(count, kGrain, threads, [&](std::int64_t begin, std::int64_t end, int) {
    Sums sums;
    for (std::int64_t slot = begin; slot < end; ++slot) {
      const double hits = totals.opacity[slot][0] / kOpacityUnit;
      const double exposure = totals.opacity[slot][1] / kOpacityUnit;
      const double looked = totals.opacity[slot][2] / kOpacityUnit;
      const double prior_tau = -std::log1p(-std::min(prior_opacity[slot], 0.999999f));
      double tau;
      if (rule == UpdateRule::kPosterior) {
        const double weight = exposure + prior_strength;
        tau = weight > 0 ? (hits + prior_strength * prior_tau) / weight : prior_tau;
        if (acceleration && weight > 0)
          tau = (*acceleration)(static_cast<std::uint32_t>(slot), volume.tau[slot], tau,
                                prior_strength / weight);
      } else {
        tau = hits > 1e-3 ? -std::log1p(-std::min(exposure / hits, 0.999999)) : prior_tau;
      }
      const float before = alpha_from_tau(volume.tau[slot]);
      volume.tau[slot] = static_cast<float>(std::clamp(tau, 0.0, static_cast<double>(kLargestTau)));
      volume.confidence[slot] = static_cast<float>(looked / (looked + 2));
      volume.support[slot] = {static_cast<float>(hits), static_cast<float>(exposure)};
      const float after = alpha_from_tau(volume.tau[slot]);
      sums.opacity += after;
      if (looked > 0) sums.change += std::abs(after - before), ++sums.looked;
    }
    blocks[begin / kGrain] = sums;
  });
  Sums all;
  for (const Sums& sums : blocks) {
    all.change += sums.change;
    all.opacity += sums.opacity;
    all.looked += sums.looked;
  }
  return {all.looked ? all.change / all.looked : 0, count ? all.opacity / count : 0};
}

void update_color(const std::vector<ColorTotals>& totals, int threads, Volume& volume) {
  parallel_for_blocks(volume.slot_count(), kGrain, threads, [&](std::int64_t begin, std::int64_t end, int) {
    for (std::int64_t slot = begin; slot < end; ++slot) {
      const VoxelColor color = color_of(totals[slot]);
      if (color.evidence <= 0) continue;
      std::copy(color.mean, color.mean + 3, volume.color_mean[slot].begin());
      volume.color_cov[slot] = PackedCovariance(std::to_array(color.cov));
      volume.color_weight[slot] = color.evidence;
    }
  });
}

}  // namespace roxel

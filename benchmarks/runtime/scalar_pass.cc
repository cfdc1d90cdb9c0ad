#include "scalar_pass.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "roxel/infer/color_packets.h"
#include "roxel/infer/segment_march.h"

namespace roxel {
namespace {

/// sqrt(|S_min| / |S|) exp(-d' S^-1 d / 2), S with the noise S_min in it: xx, yy, zz, xy, xz, yz.
float gaussian_agreement(const float d[3], const float s[6], float noise_determinant) {
  const float m00 = s[1] * s[2] - s[5] * s[5], m01 = s[4] * s[5] - s[3] * s[2];
  const float m02 = s[3] * s[5] - s[1] * s[4], m11 = s[0] * s[2] - s[4] * s[4];
  const float m12 = s[3] * s[4] - s[0] * s[5], m22 = s[0] * s[1] - s[3] * s[3];
  const float determinant = std::max(s[0] * m00 + s[3] * m01 + s[4] * m02, noise_determinant);
  const float adjugate = m00 * d[0] * d[0] + m11 * d[1] * d[1] + m22 * d[2] * d[2] +
                         2 * (m01 * d[0] * d[1] + m02 * d[0] * d[2] + m12 * d[1] * d[2]);
  return std::sqrt(noise_determinant / determinant) *
         std::exp(-0.5f * std::max(adjugate, 0.0f) / determinant);
}

/// Mean distance inside a voxel of a ray that ends there: 1/tau - l (1 - a)/a.
float mean_path(float tau, float length, float a) {
  const float x = tau * length;
  return x < 0.1f ? length * (0.5f - x / 12) : 1 / tau - length * (1 - a) / a;
}

/// One axis of a walk from cell to cell: when the ray leaves the cell, and how long it takes for one.
struct Axis {
  int cell, step;
  float leaves, takes;

  /// At `at` along the ray, `origin + t * direction`, in cells of `size` voxels, of which [first, end) count.
  Axis(float origin, float direction, float at, float size, int first, int end) {
    const float place = origin + at * direction;
    cell = std::clamp(static_cast<int>(std::floor(place / size)), first, end - 1);
    step = direction < 0 ? -1 : 1;
    if (std::abs(direction) < 1e-9f) {
      leaves = takes = 1e30f;
      return;
    }
    leaves = (size * static_cast<float>(cell + (step > 0)) - origin) / direction;
    takes = size / std::abs(direction);
  }
  void go_on() { cell += step, leaves += takes; }
};

using Axes = std::array<Axis, 3>;

/// The axis whose plane the ray meets next.
int next_axis(const Axes& axes) {
  const int low = axes[1].leaves < axes[0].leaves ? 1 : 0;
  return axes[2].leaves < axes[low].leaves ? 2 : low;
}

using ColorSums = std::array<double, 10>;  ///< w; w x; w x x'

/// A node's colour sums, its weight at most 1.
ColorSums capped(const VoxelScratch& voxel) {
  ColorSums sums{};
  if (voxel.evidence <= 0) return sums;
  const double scale = std::min(1.0f, voxel.evidence) / static_cast<double>(voxel.evidence);
  sums[0] = scale * voxel.evidence;
  for (int c = 0; c < 3; ++c) sums[1 + c] = scale * voxel.mean[c];
  for (int c = 0; c < 6; ++c) sums[4 + c] = scale * voxel.cov[c];
  return sums;
}

VoxelColor color_of_sums(const ColorSums& sums) {
  VoxelColor color;
  if (sums[0] <= 0.5 / kColorUnit) return color;  // as little as fixed point makes nothing of
  double m[3];
  for (int c = 0; c < 3; ++c) m[c] = sums[1 + c] / sums[0];
  const double moments[6] = {m[0] * m[0], m[1] * m[1], m[2] * m[2], m[0] * m[1], m[0] * m[2], m[1] * m[2]};
  for (int c = 0; c < 3; ++c) color.mean[c] = static_cast<float>(m[c]);
  for (int c = 0; c < 6; ++c) {
    const double central = sums[4 + c] / sums[0] - moments[c];
    color.cov[c] = static_cast<float>(c < 3 ? std::max(central, 0.0) : central);
  }
  color.evidence = static_cast<float>(sums[0]);
  return color;
}

template <class Visit>
void for_each_sample(const SampleNode& node, Visit&& visit) {
  for (const SampleView& view : node) {
    const int level = view.plan.root_level;
    for (int y = 0; y < view.pyramid->height(level); ++y)
      for (int x = 0; x < view.pyramid->width(level); ++x) visit(view, Region{level, x, y});
  }
}

}  // namespace

struct ScalarPass::Step {
  std::uint32_t slot;
  float length, weight;          ///< chord in voxel lengths; ray weight
  float opacity = 0, share = 0;  ///< a; a p
  float mean_path = 0;
};

ScalarPass::ScalarPass(const Volume& volume)
    : volume_(volume), index_(volume.index(0)), local_(index_.bricks().size()), voxels_(volume.slot_count()) {
  for (std::size_t b = 0; b < local_.size(); ++b) {
    const Brick& brick = index_.bricks()[b];
    local_[b].fill(kNone);
    brick.for_each_voxel([&](int v, std::uint32_t slot) {
      local_[b][v] = static_cast<std::uint16_t>(slot - brick.first_slot);
    });
  }
}

/// Calls visit(slot, length, weight) for the voxels in ray order, and brick_done() behind each brick with
/// voxels, which says whether to go on. Depths count from where the ray enters the box, in voxel lengths.
template <class Visit, class BrickDone>
void ScalarPass::walk(const Ray& ray, Stretch range, Visit&& visit, BrickDone&& brick_done) const {
  constexpr float kInverseVertexDistance = 1.1547005f;
  const LatticeFrame& frame = index_.frame();
  const Stretch inside = clip_to_box(ray, frame.box(), range);
  if (inside.end <= inside.begin) return;
  const Eigen::Vector3d entry = (ray.origin + inside.begin * ray.direction - frame.origin) / frame.voxel_size;
  const Eigen::Vector3f o = entry.cast<float>(), u = ray.direction.normalized().cast<float>();
  const auto end = static_cast<float>((inside.end - inside.begin) * ray.direction.norm() / frame.voxel_size);
  const Eigen::Vector3i n = frame.size_in_bricks;
  const auto axis_of_bricks = [&](int a) { return Axis(o[a], u[a], 0, kBrickSide, 0, n[a]); };
  Axes bricks{axis_of_bricks(0), axis_of_bricks(1), axis_of_bricks(2)};
  float at = 0;
  while (at < end) {
    const int brick_axis = next_axis(bricks);
    const float brick_end = std::min(bricks[brick_axis].leaves, end);
    const std::int32_t number = index_.brick_at(bricks[0].cell, bricks[1].cell, bricks[2].cell);
    if (number >= 0) {
      const Brick& brick = index_.bricks()[number];
      const auto axis_of_cells = [&](int a) {
        return Axis(o[a], u[a], at, 1, kBrickSide * brick.coord[a], kBrickSide * (brick.coord[a] + 1));
      };
      Axes cells{axis_of_cells(0), axis_of_cells(1), axis_of_cells(2)};
      while (at < brick_end) {
        const int cell_axis = next_axis(cells);
        const float cell_end = std::min(cells[cell_axis].leaves, brick_end);
        const std::uint16_t local =
            local_[number][voxel_in_brick(cells[0].cell & 7, cells[1].cell & 7, cells[2].cell & 7)];
        if (local != kNone && cell_end > at) {
          const float x = static_cast<float>(cells[0].cell) + 0.5f - o[0];
          const float y = static_cast<float>(cells[1].cell) + 0.5f - o[1];
          const float z = static_cast<float>(cells[2].cell) + 0.5f - o[2];
          const float cx = y * u[2] - z * u[1], cy = z * u[0] - x * u[2], cz = x * u[1] - y * u[0];
          const float weight = 1 - kInverseVertexDistance * std::sqrt(cx * cx + cy * cy + cz * cz);
          if (weight > 0) visit(brick.first_slot + local, cell_end - at, weight);
        }
        at = std::max(at, cell_end);
        cells[cell_axis].go_on();
        if ((cells[cell_axis].cell ^ (kBrickSide * brick.coord[cell_axis])) & ~7) break;
      }
      if (!brick_done()) return;
    }
    at = std::max(at, brick_end);
    bricks[brick_axis].go_on();
    if (bricks[brick_axis].cell < 0 || bricks[brick_axis].cell >= n[brick_axis]) return;
  }
}

void ScalarPass::begin_color() {
  for (std::uint32_t slot = 0; slot < voxels_.size(); ++slot) {
    voxels_[slot] = {};
    voxels_[slot].tau = volume_.tau[slot];
  }
}

PassCounts ScalarPass::march_color(const SampleNode& node, const MarchOptions& options) {
  PassCounts counts;
  const float spent = spent_transmittance(options.rule);
  for_each_sample(node, [&](const SampleView& view, const Region& region) {
    const RegionStats sample = view.pyramid->at(region.level, region.x, region.y);
    if (sample.valid <= 0) return;
    const float* m = sample.mean;
    const float second[6] = {sample.cov[0] + m[0] * m[0], sample.cov[1] + m[1] * m[1],
                             sample.cov[2] + m[2] * m[2], sample.cov[3] + m[0] * m[1],
                             sample.cov[4] + m[0] * m[2], sample.cov[5] + m[1] * m[2]};
    const float whole = color_weight(view, region, sample, options);
    float transmittance = 1;
    ++counts.rays;
    walk(
        region_ray(view, region), view.plan.range,
        [&](std::uint32_t slot, float length, float weight) {
          ++counts.steps;
          VoxelScratch& voxel = voxels_[slot];
          const float a = 1 - std::exp(-voxel.tau * length);
          const float w = whole * weight * a * transmittance;
          transmittance *= 1 - a;
          if (w < kLeastColorWeight) return;
          voxel.evidence += w;
          for (int c = 0; c < 3; ++c) voxel.mean[c] += w * m[c];
          for (int c = 0; c < 6; ++c) voxel.cov[c] += w * second[c];
        },
        [&] { return transmittance >= spent; });
  });
  return counts;
}

void ScalarPass::begin_opacity(const std::vector<VoxelColor>& compared_with) {
  for (std::uint32_t slot = 0; slot < voxels_.size(); ++slot) {
    VoxelScratch& voxel = voxels_[slot];
    voxel = {};
    std::copy(compared_with[slot].mean, compared_with[slot].mean + 3, voxel.mean);
    std::copy(compared_with[slot].cov, compared_with[slot].cov + 6, voxel.cov);
    voxel.evidence = compared_with[slot].evidence;
    voxel.tau = volume_.tau[slot];
  }
}

PassCounts ScalarPass::march_opacity(const SampleNode& node, const MarchOptions& options) {
  PassCounts counts;
  const MatchModel& model = options.model;
  const float* noise = model.noise_variance;
  const float noise_determinant = noise[0] * noise[1] * noise[2];
  std::vector<Step> steps;
  for_each_sample(node, [&](const SampleView& view, const Region& region) {
    const RegionStats sample = view.pyramid->at(region.level, region.x, region.y);
    if (sample.valid <= 0) return;
    const float weight_of_sample = observation_weight(view, region, sample);
    float transmittance = 1, likelihood = 0;
    steps.clear();
    ++counts.rays;
    walk(
        region_ray(view, region), view.plan.range,
        [&](std::uint32_t slot, float length, float weight) {
          const VoxelScratch& voxel = voxels_[slot];
          float d[3], s[6];
          for (int c = 0; c < 3; ++c) d[c] = voxel.mean[c] - sample.mean[c];
          for (int c = 0; c < 6; ++c) s[c] = voxel.cov[c] + sample.cov[c] + (c < 3 ? noise[c] : 0);
          const float w = voxel.evidence, w_0 = model.evidence_half;
          const float matched = gaussian_agreement(d, s, noise_determinant);
          const float p =
              sample.foreground * (w * matched + w_0 * model.uninformative) / (w + w_0) + model.outlier;
          const float a = 1 - std::exp(-voxel.tau * length);
          steps.push_back({slot, length, weight, a, a * p, mean_path(voxel.tau, length, a)});
          likelihood += transmittance * a * p;
          transmittance *= 1 - a;
        },
        [&] { return transmittance >= SegmentMarch::kNegligible * likelihood; });

    const float z = likelihood + transmittance * options.background.unknown_likelihood;
    float reach = 1, so_far = 1;
    for (const Step& step : steps) {
      VoxelScratch& voxel = voxels_[step.slot];
      const float r = std::min(so_far * step.share / z, reach);
      voxel.hits += weight_of_sample * r;
      voxel.exposure += weight_of_sample * ((reach - r) * step.length + r * step.mean_path);
      voxel.looked = std::max(voxel.looked, reach * step.weight);
      reach -= r;
      so_far *= 1 - step.opacity;
    }
    counts.steps += static_cast<std::int64_t>(steps.size());
    counts.log_likelihood += static_cast<double>(weight_of_sample) * std::log(z);
    counts.observation_weight += weight_of_sample;
  });
  return counts;
}

ScalarPass::Result ScalarPass::run(const std::vector<SampleNode>& nodes, const PassOptions& options) {
  const std::size_t count = voxels_.size();
  std::vector<ColorSums> totals(count, ColorSums{});
  for (const SampleNode& node : nodes) {
    begin_color();
    march_color(node, options.opacity);
    for (std::size_t v = 0; v < count; ++v) {
      const ColorSums own = capped(voxels_[v]);
      for (std::size_t c = 0; c < own.size(); ++c) totals[v][c] += own[c];
    }
  }
  Result result;
  result.hits.resize(count), result.exposure.resize(count), result.tau.resize(count);
  std::vector<VoxelColor> others(count);
  for (const SampleNode& node : nodes) {
    begin_color();
    if (options.predictive) march_color(node, options.opacity);
    for (std::size_t v = 0; v < count; ++v) {
      ColorSums rest = totals[v];
      const ColorSums own = capped(voxels_[v]);
      for (std::size_t c = 0; c < own.size(); ++c) rest[c] -= own[c];
      others[v] = color_of_sums(rest);
    }
    begin_opacity(others);
    result.opacity += march_opacity(node, options.opacity);
    for (std::size_t v = 0; v < count; ++v) {
      result.hits[v] += voxels_[v].hits;
      result.exposure[v] += voxels_[v].exposure;
    }
  }
  const double beta = options.prior.strength, prior_tau = -std::log1p(-options.prior.opacity);
  for (std::size_t v = 0; v < count; ++v)
    result.tau[v] = std::clamp((result.hits[v] + beta * prior_tau) / (result.exposure[v] + beta), 0.0, 16.0);
  return result;
}

ScalarPass::Meets ScalarPass::meets(const SampleNode& node) const {
  double steps = 0, bricks = 0, rays = 0, voxels = 0;
  for (const SampleView& view : node) {
    const int level = view.plan.root_level;
    const int width = view.pyramid->width(level), height = view.pyramid->height(level);
    for (int y0 = 0; y0 < height; y0 += 8)
      for (int x0 = 0; x0 < width; x0 += 8) {
        std::unordered_set<std::uint32_t> met;
        for (int y = y0; y < std::min(y0 + 8, height); ++y)
          for (int x = x0; x < std::min(x0 + 8, width); ++x) {
            const double before = steps;
            walk(
                region_ray(view, {level, x, y}), view.plan.range,
                [&](std::uint32_t slot, float, float) { met.insert(slot), ++steps; },
                [&] { return ++bricks, true; });
            rays += steps > before;
          }
        voxels += static_cast<double>(met.size());
      }
  }
  return {steps / rays, bricks / rays, voxels / steps};
}

}  // namespace roxel

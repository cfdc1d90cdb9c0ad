#include "roxel/solve/surface_paint.h"

#include <cmath>
#include <limits>

#include "roxel/base/parallel.h"
#include "roxel/march/render.h"
#include "roxel/solve/surface_color.h"

namespace roxel {
namespace {

constexpr std::int64_t kPaintGrain = 1024;
constexpr int kBounces = 2;
constexpr float kWhitest = 0.95f;  ///< albedo that light is given back with, at most

/// What a node shows of a voxel in one light.
struct Sighting {
  int sky;
  float weight;
  Rgb seen;
};

/// Sightings of all slots, slot by slot, nodes in order.
struct Sightings {
  std::vector<std::uint32_t> first;  ///< one a slot, and the end
  std::vector<Sighting> all;
  std::vector<Eigen::Vector3f> towards;  ///< one a slot: where it is seen from

  /// Of a slot, those in a known light; where there is none, all.
  std::vector<std::uint32_t> counted(std::uint32_t slot) const {
    std::vector<std::uint32_t> known, others;
    for (std::uint32_t i = first[slot]; i < first[slot + 1]; ++i)
      (all[i].sky >= 0 ? known : others).push_back(i);
    return known.empty() ? others : known;
  }
};

/// The views of a node that were taken in one light.
struct LitNode {
  int node, sky;  ///< sky: -1 where none is known
};

/// Nodes once more, those whose views have several skies in parts: what each is stands in `lit`.
std::vector<SampleNode> parts_of_one_light(const Dataset& dataset, const Daylight& daylight,
                                           const std::vector<SampleNode>& nodes, std::vector<LitNode>& lit) {
  std::vector<SampleNode> parts;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const std::size_t first = parts.size();
    for (std::size_t i = 0; i < nodes[n].size(); ++i) {
      const int view = dataset.nodes[n].view_idxs[i];
      const int sky = daylight.of_view(view) ? daylight.sky_of_views[view] : -1;
      std::size_t part = first;
      while (part < parts.size() && lit[part].sky != sky) ++part;
      if (part == parts.size()) {
        parts.emplace_back();
        lit.push_back({static_cast<int>(n), sky});
      }
      parts[part].push_back(nodes[n][i]);
    }
  }
  return parts;
}

/// Calls visit(slot, centre) for all voxels.
template <class Visit>
void for_each_voxel(const Volume& volume, Visit&& visit) {
  for (int k = 0; k < volume.lattice_count(); ++k) {
    const BrickIndex& index = volume.index(k);
    for (const Brick& brick : index.bricks())
      brick.for_each_voxel(
          [&](int v, std::uint32_t slot) { visit(slot, index.frame().voxel_centre(voxel_of(brick, v))); });
  }
}

Sightings collect(const Dataset& dataset, const Daylight& daylight, const std::vector<SampleNode>& nodes,
                  const PassOptions& pass, const LatticeStack& stack, const RunContext& context) {
  const Volume& volume = stack.volume();
  std::vector<LitNode> lit;
  const std::vector<SampleNode> parts = parts_of_one_light(dataset, daylight, nodes, lit);
  CollectedColors colors(volume.slot_count(), parts.size(), std::numeric_limits<std::int64_t>::max());
  PassOptions keeping = pass;
  keeping.predictive = true;  // each node's own are what is wanted
  collect_color(stack, parts, keeping, context, nullptr, colors);
  Sightings found;
  found.first.assign(volume.slot_count() + 1, 0);
  for (std::size_t n = 0; n < parts.size(); ++n)
    for (const OwnColors::Entry& entry : colors.kept.of(n)->entries) ++found.first[entry.slot + 1];
  for (std::size_t slot = 0; slot < volume.slot_count(); ++slot) found.first[slot + 1] += found.first[slot];
  found.all.resize(found.first.back());
  found.towards.assign(volume.slot_count(), Eigen::Vector3f::Zero());
  std::vector<Eigen::Vector3f> centres(volume.slot_count());
  for_each_voxel(volume,
                 [&](std::uint32_t slot, const Eigen::Vector3d& x) { centres[slot] = x.cast<float>(); });
  std::vector<std::uint32_t> next(found.first.begin(), found.first.end() - 1);
  for (std::size_t n = 0; n < parts.size(); ++n) {
    const Eigen::Vector3f centre = dataset.nodes[lit[n].node].centre.cast<float>();
    for (const OwnColors::Entry& entry : colors.kept.of(n)->entries) {
      Sighting& seen = found.all[next[entry.slot]++];
      seen = {lit[n].sky, std::min(1.0f, entry.color.evidence), {}};
      for (int c = 0; c < 3; ++c) seen.seen[c] = entry.color.mean[c] / entry.color.evidence;
      found.towards[entry.slot] += seen.weight * (centre - centres[entry.slot]).normalized();
    }
  }
  return found;
}

LitColor lit(const Sighting& seen, const SurfaceLight& light, std::int32_t place) {
  LitColor color{seen.seen, seen.weight};
  if (seen.sky < 0) return color;
  color.diffuse = light.diffuse(seen.sky, place);
  color.sun = light.sun(seen.sky, place);
  color.sunlit = light.sunlit(seen.sky, place);
  return color;
}

/// Albedo of every place from its sightings, which also say whether the sun gets there. Always judged anew
/// from the marched shadow.
class Painter {
 public:
  Painter(const Sightings& sightings, const RunContext& context, SurfaceLight& light)
      : sightings_(sightings), context_(context), light_(light) {
    for (std::size_t place = 0; place < light.voxels().count(); ++place)
      for (int s = 0; s < light.sky_count(); ++s) marched_.push_back(light.sunlit(s, place));
    albedo_.assign(light.voxels().count(), {0, 0, 0});
  }

  /// `whitest` is the canonical colour of a surface that gives back all light.
  void look(float whitest) {
    whitest_ = whitest;
    parallel_for_blocks(static_cast<std::int64_t>(albedo_.size()), kPaintGrain, context_.thread_count(),
                        [&](std::int64_t begin, std::int64_t end, int) {
                          context_.throw_if_cancelled();
                          for (std::int64_t p = begin; p < end; ++p) look_at(static_cast<std::size_t>(p));
                        });
  }
  const std::vector<Rgb>& albedo() const { return albedo_; }
  /// Share of light that is given back.
  std::vector<Rgb> reflectance() const {
    std::vector<Rgb> scaled = albedo_;
    for (Rgb& rgb : scaled)
      for (float& value : rgb) value = std::min(value / whitest_, kWhitest);
    return scaled;
  }

 private:
  void look_at(std::size_t place) {
    const std::uint32_t slot = light_.voxels().slots[place];
    std::vector<LitColor> seen;
    const std::vector<std::uint32_t> counted = sightings_.counted(slot);
    for (const std::uint32_t i : counted) {
      const Sighting& sighting = sightings_.all[i];
      seen.push_back(lit(sighting, light_, static_cast<std::int32_t>(place)));
      if (sighting.sky >= 0) seen.back().sunlit = marched_[index(sighting.sky, place)];
    }
    const SurfaceColor color = surface_color(seen);
    for (int c = 0; c < 3; ++c) albedo_[place][c] = std::min(color.albedo[c], whitest_);
    for (std::size_t i = 0; i < seen.size(); ++i)
      if (const int sky = sightings_.all[counted[i]].sky; sky >= 0)
        light_.set_sunlit(sky, place, color.sunlit[i]);
  }
  std::size_t index(int sky, std::size_t place) const {
    return place * static_cast<std::size_t>(light_.sky_count()) + static_cast<std::size_t>(sky);
  }

  const Sightings& sightings_;
  const RunContext& context_;
  SurfaceLight& light_;
  std::vector<float> marched_;
  std::vector<Rgb> albedo_;
  float whitest_ = 0;
};

/// Mean and spread, in linear RGB, of what the sightings make of a voxel's colour.
struct Spread {
  Rgb mean{0, 0, 0};
  std::array<float, 6> cov{};
  float weight = 0;
};

Spread spread_of(const Sightings& sightings, const SurfaceLight& light, std::uint32_t slot) {
  Spread spread;
  std::array<double, 3> mean{};
  std::array<double, 6> second{};
  double weights = 0;
  for (const std::uint32_t i : sightings.counted(slot)) {
    const Sighting& seen = sightings.all[i];
    const Rgb by = light.of(seen.sky, slot);
    std::array<double, 3> x;
    for (int c = 0; c < 3; ++c) x[c] = seen.seen[c] / std::max(by[c], 1e-4f);
    weights += seen.weight;
    for (int c = 0; c < 3; ++c) mean[c] += seen.weight * x[c], second[c] += seen.weight * x[c] * x[c];
    second[3] += seen.weight * x[0] * x[1];
    second[4] += seen.weight * x[0] * x[2];
    second[5] += seen.weight * x[1] * x[2];
  }
  if (!(weights > 0)) return spread;
  for (double& value : mean) value /= weights;
  for (double& value : second) value /= weights;
  spread.weight = static_cast<float>(weights);
  for (int c = 0; c < 3; ++c) {
    spread.mean[c] = static_cast<float>(mean[c]);
    spread.cov[c] = static_cast<float>(std::max(0.0, second[c] - mean[c] * mean[c]));
  }
  spread.cov[3] = static_cast<float>(second[3] - mean[0] * mean[1]);
  spread.cov[4] = static_cast<float>(second[4] - mean[0] * mean[2]);
  spread.cov[5] = static_cast<float>(second[5] - mean[1] * mean[2]);
  return spread;
}

/// The spread in the matching space, to first order.
void put(const Spread& spread, const ColorTransform& transform, std::uint32_t slot, Volume& volume) {
  if (!(spread.weight > 0)) return;
  transform.from_rgb(spread.mean.data(), volume.color_mean[slot].data());
  Eigen::Matrix3f jacobian, cov;
  for (int a = 0; a < 3; ++a) {
    const float step = std::max(1e-3f, 0.02f * spread.mean[a]);
    Rgb up = spread.mean, down = spread.mean;
    up[a] += step, down[a] = std::max(0.0f, down[a] - step);
    Eigen::Vector3f high, low;
    transform.from_rgb(up.data(), high.data());
    transform.from_rgb(down.data(), low.data());
    jacobian.col(a) = (high - low) / (up[a] - down[a]);
  }
  cov << spread.cov[0], spread.cov[3], spread.cov[4],  //
      spread.cov[3], spread.cov[1], spread.cov[5],     //
      spread.cov[4], spread.cov[5], spread.cov[2];
  cov = jacobian * cov * jacobian.transpose();
  volume.color_cov[slot] =
      PackedCovariance({cov(0, 0), cov(1, 1), cov(2, 2), cov(0, 1), cov(0, 2), cov(1, 2)});
  volume.color_weight[slot] = spread.weight;
}

}  // namespace

SurfaceLight paint_without_daylight(const Dataset& dataset, const Scene& scene, const Daylight& daylight,
                                    const std::vector<SampleNode>& nodes, const PassOptions& pass,
                                    float least_opacity, const RunContext& context, Volume& volume) {
  const LatticeStack stack(volume);
  const Sightings sightings = collect(dataset, daylight, nodes, pass, stack, context);
  SurfaceLight light(stack, surface_voxels(volume, least_opacity, sightings.towards, context.thread_count()),
                     daylight, context);
  Painter painter(sightings, context, light);
  const double white = mean_light(daylight) / scene.exposure;
  painter.look(static_cast<float>(white));
  for (int bounce = 0; bounce < kBounces; ++bounce) {
    light.add_bounce(painter.reflectance(), context);
    painter.look(static_cast<float>(white));
  }
  parallel_for_blocks(volume.slot_count(), kPaintGrain, context.thread_count(),
                      [&](std::int64_t begin, std::int64_t end, int) {
                        for (std::int64_t s = begin; s < end; ++s) {
                          const auto slot = static_cast<std::uint32_t>(s);
                          Spread spread = spread_of(sightings, light, slot);
                          const std::int32_t place = light.voxels().places[slot];
                          if (place >= 0 && spread.weight > 0) spread.mean = painter.albedo()[place];
                          put(spread, scene.transform, slot, volume);
                        }
                      });
  return light;
}

Image light_of_pixels(const LatticeStack& stack, const SurfaceLight& light, int sky,
                      const PinholeCamera& camera, Stretch range, const RunContext& context) {
  const std::vector<Rgb> colors =
      in_light_of(light, sky, std::vector<Rgb>(stack.volume().slot_count(), Rgb{1, 1, 1}));
  RenderOptions box_alone;
  box_alone.surround = false;
  Rendering seen = render(stack, colors, camera, range, box_alone, context);
  for (std::size_t i = 0; i < seen.opacity.data().size(); ++i)
    for (int c = 0; c < 3; ++c) {
      float& value = seen.rgb.data()[3 * i + c];
      value = seen.opacity.data()[i] > 0.5f ? value / seen.opacity.data()[i] : 0.0f;
    }
  return std::move(seen.rgb);
}

std::vector<Rgb> in_light_of(const SurfaceLight& light, int sky, std::vector<Rgb> colors) {
  for (std::uint32_t slot = 0; slot < colors.size(); ++slot) {
    const Rgb by = light.of(sky, slot);
    for (int c = 0; c < 3; ++c) colors[slot][c] *= by[c];
  }
  return colors;
}

}  // namespace roxel

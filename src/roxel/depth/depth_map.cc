#include "roxel/depth/depth_map.h"

#include <cmath>

#include "roxel/march/brick_sight.h"

namespace roxel {

namespace {

/// Responsibility of one chord and where in depth it lies.
struct Share {
  float weight;
  float depth;       ///< where rays that end in the chord end on average
  float half_chord;  ///< in depth
};

struct PixelDepth {
  float depth = 0, variance = 0, opacity = 0;
};

/// Index of the share in which half of the responsibility is reached.
std::size_t median_share(const std::vector<Share>& shares) {
  float total = 0, sum = 0;
  for (const Share& share : shares) total += share.weight;
  for (std::size_t i = 0; i < shares.size(); ++i)
    if ((sum += shares[i].weight) >= 0.5f * total) return i;
  return shares.size() - 1;
}

/// Mean and variance over shares [begin, end).
PixelDepth moments(const std::vector<Share>& shares, std::size_t begin, std::size_t end) {
  double weight = 0, first = 0, second = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const double w = shares[i].weight, d = shares[i].depth, h = shares[i].half_chord;
    weight += w;
    first += w * d;
    second += w * (d * d + h * h / 3);
  }
  if (weight <= 0) return {};
  const double mean = first / weight;
  return {static_cast<float>(mean), static_cast<float>(std::max(0.0, second / weight - mean * mean)), 0};
}

/// The run of shares around `middle` whose chords follow on each other and carry at least a fiftieth of the
/// middle one's responsibility.
std::pair<std::size_t, std::size_t> main_mode(const std::vector<Share>& shares, std::size_t middle) {
  const float least = 0.02f * shares[middle].weight;
  const auto joined = [&](std::size_t a, std::size_t b) {
    return shares[b].depth - shares[a].depth < 2 * (shares[a].half_chord + shares[b].half_chord);
  };
  std::size_t begin = middle, end = middle + 1;
  while (begin > 0 && shares[begin - 1].weight > least && joined(begin - 1, begin)) --begin;
  while (end < shares.size() && shares[end].weight > least && joined(end - 1, end)) ++end;
  return {begin, end};
}

PixelDepth summarise(const std::vector<Share>& shares, float total, float voxel_variance,
                     DepthEstimate estimate) {
  if (total < DepthMap::kLeastOpacity || shares.empty()) return {0, 0, total};
  const PixelDepth mean = moments(shares, 0, shares.size());
  const std::size_t middle = median_share(shares);
  PixelDepth pixel = mean;
  if (estimate == DepthEstimate::kMedian) pixel.depth = shares[middle].depth;
  if (estimate == DepthEstimate::kMainMode) {
    const auto [begin, end] = main_mode(shares, middle);
    pixel.depth = moments(shares, begin, end).depth;
  }
  const float off = pixel.depth - mean.depth;
  pixel.variance = mean.variance + off * off + voxel_variance;
  pixel.opacity = total;
  return pixel;
}

/// Evaluates single pixels against the colours that a prepared scratch holds.
class PixelDepthMarch {
 public:
  PixelDepthMarch(const LatticeStack& stack, const PassOptions& pass, const DepthOptions& options,
                  NodeScratch& scratch)
      : pass_(pass),
        options_(options),
        box_slots_(stack.volume().box_slot_count()),
        march_(stack, scratch, pass.opacity.model, pass.opacity.background, pass.opacity.filters) {
    march_.set_depths(true);
  }

  /// Whether the pixel's colour says that its ray, through its centre, ends in the box or may do so.
  bool has_depth(const RegionStats& sample) const {
    if (sample.valid <= 0) return false;
    return sample.foreground >= 0.5f || pass_.opacity.background.kind != BackgroundKind::kMask;
  }

  PixelDepth at(const SampleView& view, RegionStats sample, const Ray& ray, const Stretch* sight, int x,
                int y) {
    sample.foreground = sample.foreground >= 0.5f ? 1.0f : 0.0f;
    steps_.clear();
    shares_.clear();
    RemovedColor removed;
    const Segment whole = march_.march(view, {0, x, y}, sample, ray, view.plan.range, sight, removed, steps_);
    const float background =
        background_likelihood(pass_.opacity.background, pass_.opacity.model, view, sample);
    const float z = whole.likelihood + whole.transmittance * background;
    float transmittance = 1, total = 0, in_world = 0;
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      const EvaluatedStep step = steps_[i];
      const float prior = transmittance * step.opacity;
      transmittance *= 1 - step.opacity;
      if (step.slot >= box_slots_) continue;
      const float posterior = z > 0 ? prior * step.likelihood / z : 0;
      const float r = options_.weight == DepthWeight::kPrior ? prior : posterior;
      const float weight = options_.weight == DepthWeight::kTimesOpacity ? r * step.opacity : r;
      const float into_chord = step.length > 0 ? step.mean_path / step.length : 0.5f;
      const StepDepth chord = steps_.depth(i);
      shares_.push_back({weight, chord.middle + (2 * into_chord - 1) * chord.half_chord, chord.half_chord});
      total += r;
      in_world = step.length > 0 ? 2 * chord.half_chord / step.length : in_world;
    }
    return summarise(shares_, total, in_world * in_world / 12, options_.estimate);
  }

 private:
  const PassOptions& pass_;
  const DepthOptions& options_;
  std::uint32_t box_slots_;
  SegmentMarch march_;
  EvaluatedSteps steps_;
  std::vector<Share> shares_;
};

OptionTable<DepthOptions> make_depth_map_table() {
  OptionTable<DepthOptions> table;
  table.group("Depth");
  table
      .add("depth-estimate", &DepthOptions::estimate,
           {{"main-mode", DepthEstimate::kMainMode},
            {"mean", DepthEstimate::kMean},
            {"median", DepthEstimate::kMedian}})
      .help(
          "The volume's depth of a pixel: mean over the unbroken stretch where its ray most likely ends; or "
          "over all of the ray; or median")
      .source("[Jethwa04] eq. (6.1)");
  table
      .add("depth-weight", &DepthOptions::weight,
           {{"posterior", DepthWeight::kPosterior},
            {"times-opacity", DepthWeight::kTimesOpacity},
            {"prior", DepthWeight::kPrior}})
      .help(
          "What a voxel counts in that: the probability that the ray ends there; that times its opacity, as "
          "the thesis has it; or without the pixel's colour")
      .source("[Jethwa04] eq. (6.1)");
  return table;
}

}  // namespace

const OptionTable<DepthOptions>& depth_map_option_table() {
  static const OptionTable<DepthOptions> table = make_depth_map_table();
  return table;
}

std::vector<DepthMap> estimate_depth(const LatticeStack& stack, const SampleNode& views,
                                     const PassOptions& pass, const DepthOptions& options,
                                     const RunContext& context, NodeScratch& scratch) {
  PixelDepthMarch march(stack, pass, options, scratch);
  std::vector<DepthMap> maps;
  for (const SampleView& view : views) {
    const int width = view.camera.intrinsics.width, height = view.camera.intrinsics.height;
    const BrickSight sight(stack, view.camera);
    DepthMap map{Image(width, height, 1), Image(width, height, 1), Image(width, height, 1)};
    for (int y = 0; y < height; ++y) {
      context.throw_if_cancelled();
      for (int x = 0; x < width; ++x) {
        const RegionStats sample = view.pyramid->at(0, x, y);
        if (!march.has_depth(sample)) continue;
        const PixelDepth pixel =
            march.at(view, sample, view.camera.ray(x + 0.5, y + 0.5), sight.at(x + 0.5, y + 0.5), x, y);
        *map.depth.pixel(x, y) = pixel.depth;
        *map.variance.pixel(x, y) = pixel.variance;
        *map.opacity.pixel(x, y) = pixel.opacity;
      }
    }
    maps.push_back(std::move(map));
  }
  return maps;
}

}  // namespace roxel

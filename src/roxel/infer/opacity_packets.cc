#include "roxel/infer/opacity_packets.h"

#include <cmath>

namespace roxel {

namespace {

constexpr float kLeast = 1e-30f;   ///< of likelihoods whose logarithm is taken
constexpr float kNothing = 1e-6f;  ///< probabilities that are not handed on

/// Weighted logarithms of what samples say.
struct LogSum {
  double weight = 0, log = 0;
};

/// What the finest samples of a region say of the background: the sum of the logarithms of p_bg.
LogSum background_of(const SampleView& view, const Region& region, const MarchOptions& options) {
  const SamplePyramid& pyramid = *view.pyramid;
  const int level = view.plan.last_level(), halvings = region.level - level;
  const int x1 = std::min((region.x + 1) << halvings, pyramid.width(level));
  const int y1 = std::min((region.y + 1) << halvings, pyramid.height(level));
  LogSum sum;
  float likelihood = 1, log_likelihood = 0;  // most samples are like the one before
  for (int y = region.y << halvings; y < y1; ++y)
    for (int x = region.x << halvings; x < x1; ++x) {
      const RegionStats sample = pyramid.at(level, x, y);
      if (sample.valid <= 0) continue;
      const float here = background_likelihood(options.background, options.model, view, sample);
      if (here != likelihood) {
        likelihood = here;
        log_likelihood = std::log(std::max(here, kLeast));
      }
      const float weight = observation_weight(view, {level, x, y}, sample);
      sum.weight += weight;
      sum.log += weight * log_likelihood;
    }
  return sum;
}

}  // namespace

bool OpacityPackets::serves(const MarchOptions& options) {
  const SampleFilters& filters = options.filters;
  return options.rule == UpdateRule::kPosterior && !filters.rays && !filters.background &&
         !filters.interpolate;
}

void OpacityPackets::tile(const ListedView& listed, const Tile& tile) {
  const SampleView& view = listed.view;
  if (listed.lists.none_from(view.plan.root_level, tile.x0, tile.y0)) return count_background(view, tile);
  samples_.clear();
  roots_ = 0;
  packets_.clear();
  levels_.clear();
  record_.clear();
  march_tile(*this, listed, tile);

  look_behind(view);
  for (std::size_t i = 0; i < roots_; ++i) {
    counts.observation_weight += samples_[i].weight;
    counts.log_likelihood += samples_[i].weight * std::log(std::max(samples_[i].z, kLeast));
    samples_[i].reach = 1;
  }
  distribute();
}

/// Rays that meet nothing still have their likelihood.
void OpacityPackets::count_background(const SampleView& view, const Tile& tile) {
  for (int y = tile.y0; y < tile.y1; ++y)
    for (int x = tile.x0; x < tile.x1; ++x) {
      const LogSum sum = background_of(view, {view.plan.root_level, x, y}, options_);
      counts.observation_weight += sum.weight;
      counts.log_likelihood += sum.log;
    }
}

/// Adds the region's sample, unless it has no valid pixels.
void OpacityPackets::add(const SampleView& view, const Region& region, int parent) {
  const float valid = view.pyramid->valid(region.level, region.x, region.y);
  if (valid <= 0) return;
  samples_.push_back({region, observation_weight(view, region, valid)});
  if (parent < 0) roots_ = samples_.size();
}

/// Marches the rays begun, and keeps the packet with its steps.
void OpacityPackets::march(const SampleView& view, const SamplePacket& begun) {
  Packet packet{begun, record_.size(), 0};
  PacketTerms terms;
  for (int ray = 0; ray < packet.count; ++ray)
    terms.set(ray, sample_terms(stats_of(view, samples_[packet.sample[ray]]), options_.model));
  const PacketSegments segments = march_.march(packet.count, terms, record_);
  packet.end_step = record_.size();
  for (int ray = 0; ray < packet.count; ++ray)
    samples_[packet.sample[ray]].own = {segments.transmittance[ray], segments.likelihood[ray]};
  counts.steps += packet.end_step - packet.first_step;
  counts.rays += packet.count;
  packets_.push_back(packet);
}

/// Children are quarter-weight observations of what lies behind, unless there is nothing more.
bool OpacityPackets::divides(const SampleView&, std::size_t index, bool last) {
  Sample& sample = samples_[index];
  sample.ends = last || sample.own.transmittance < SegmentMarch::kNegligible * sample.own.likelihood;
  return !sample.ends;
}

void OpacityPackets::divided(std::size_t sample, std::size_t first_child, std::size_t end_child) {
  samples_[sample].first_child = static_cast<int>(first_child);
  samples_[sample].end_child = static_cast<int>(end_child);
}

/// What the children would say, were there any.
void OpacityPackets::nothing_behind(const SampleView& view, std::size_t index) {
  Sample& sample = samples_[index];
  const LogSum sum = background_of(view, sample.region, options_);
  if (sum.weight > 0) sample.behind = static_cast<float>(std::exp(sum.log / sum.weight));
}

/// Likelihoods from the finest samples up: behind = prod Z_c^{share}.
void OpacityPackets::look_behind(const SampleView& view) {
  for (std::size_t i = samples_.size(); i-- > 0;) {
    Sample& sample = samples_[i];
    float total = 0, log_sum = 0;
    for (int c = sample.first_child; c < sample.end_child; ++c) {
      total += samples_[c].weight;
      log_sum += samples_[c].weight * std::log(std::max(samples_[c].z, kLeast));
    }
    if (total > 0)
      sample.behind = std::exp(log_sum / total);
    else if (sample.ends)
      sample.behind =
          background_likelihood(options_.background, options_.model, view, stats_of(view, sample));
    sample.z = sample.own.likelihood + sample.own.transmittance * sample.behind;
  }
}

/// Gives the roots' reach out to voxels and children, level by level.
void OpacityPackets::distribute() {
  std::size_t sample = 0, packet = 0;
  for (const Level& level : levels_) {
    for (; packet < level.end_packet; ++packet) give_out(packets_[packet]);
    for (; sample < level.end_sample; ++sample) hand_on(samples_[sample]);
  }
}

void OpacityPackets::give_out(const Packet& packet) {
  PacketReach rays;
  bool any_reach = false;
  for (int ray = 0; ray < packet.count; ++ray) {
    const Sample& sample = samples_[packet.sample[ray]];
    if (sample.z <= 0) continue;
    rays.reach[ray] = sample.reach;
    rays.scale[ray] = sample.reach / sample.z;
    rays.weight[ray] = sample.weight;
    any_reach |= sample.reach > 0;
  }
  if (any_reach) march_.give_out(record_, packet.first_step, packet.end_step, options_.ray_weights, rays);
}

/// Hands what a sample's stretch leaves on to its children.
void OpacityPackets::hand_on(const Sample& sample) {
  if (sample.z <= 0) return;
  const float onward = sample.reach * sample.own.transmittance * sample.behind / sample.z;
  if (onward <= kNothing) return;
  for (int c = sample.first_child; c < sample.end_child; ++c) samples_[c].reach = onward;
}

}  // namespace roxel

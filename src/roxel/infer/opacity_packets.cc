#include "roxel/infer/opacity_packets.h"

#include <cmath>

namespace roxel {

namespace {

constexpr float kLeast = 1e-30f;   ///< of likelihoods whose logarithm is taken
constexpr float kNothing = 1e-6f;  ///< probabilities that are not handed on

}  // namespace

bool OpacityPackets::serves(const MarchOptions& options) {
  const SampleFilters& filters = options.filters;
  return options.rule == UpdateRule::kPosterior && !filters.rays && !filters.background &&
         !filters.interpolate;
}

void OpacityPackets::tile(const ViewInSight& in_sight, const Tile& tile) {
  const SampleView& view = in_sight.view;
  samples_.clear();
  packets_.clear();
  levels_.clear();
  rows_.clear();
  // Blocks of 4 x 2 make packets of close neighbours.
  for (int y = tile.y0; y < tile.y1; y += 2)
    for (int x = tile.x0; x < tile.x1; x += 4)
      for (int i = 0; i < kLanes; ++i)
        if (x + i % 4 < tile.x1 && y + i / 4 < tile.y1)
          add(view, {view.plan.root_level, x + i % 4, y + i / 4});
  const std::size_t roots = samples_.size();

  double begin = view.plan.range.begin;
  std::size_t first = 0;
  for (int level = view.plan.root_level; first < samples_.size(); --level) {
    const Stretch range = served_range(view, {level, 0, 0}, begin);
    const std::size_t end = samples_.size();
    march_level(in_sight, first, range);
    const bool last = range.end >= view.plan.range.end || level == view.plan.finest_level;
    for (std::size_t i = first; i < end; ++i) divide(view, i, last);
    levels_.push_back({end, packets_.size()});
    begin = std::max(range.begin, range.end);
    first = end;
  }

  look_behind(view);
  for (std::size_t i = 0; i < roots; ++i) {
    counts.observation_weight += samples_[i].weight;
    counts.log_likelihood += samples_[i].weight * std::log(std::max(samples_[i].z, kLeast));
    samples_[i].reach = 1;
  }
  distribute();
}

RegionStats OpacityPackets::stats_of(const SampleView& view, const Sample& sample) {
  return view.pyramid->at(sample.region.level, sample.region.x, sample.region.y);
}

/// Adds the region's sample, unless it has no valid pixels.
void OpacityPackets::add(const SampleView& view, const Region& region) {
  const float valid = view.pyramid->valid(region.level, region.x, region.y);
  if (valid > 0) samples_.push_back({region, observation_weight(view, region, valid)});
}

/// Marches all samples from `begin` on over the range that their level serves.
void OpacityPackets::march_level(const ViewInSight& in_sight, std::size_t begin, Stretch range) {
  if (range.end <= range.begin) return;
  Packet packet;
  for (std::size_t i = begin; i < samples_.size(); ++i) {
    const Eigen::Vector2d at = region_centre(in_sight.view, samples_[i].region);
    const Stretch* sight = in_sight.sight.within(at.x(), at.y(), range);
    if (!sight) continue;
    march_.begin(packet.count, in_sight.view.camera.ray(at.x(), at.y()), range, sight);
    packet.sample[packet.count++] = static_cast<int>(i);
    if (packet.count == kLanes) march_packet(in_sight.view, packet);
  }
  if (packet.count > 0) march_packet(in_sight.view, packet);
}

/// Marches the rays begun; the packet is kept with its rows, and is empty again.
void OpacityPackets::march_packet(const SampleView& view, Packet& packet) {
  LaneTerms terms;
  for (int lane = 0; lane < kLanes; ++lane) {
    const Sample& sample = samples_[packet.sample[std::min(lane, packet.count - 1)]];
    terms.set(lane, sample_terms(stats_of(view, sample), options_.model));
  }
  packet.first_row = rows_.size();
  const PacketSegments segments = march_.march(terms, rows_);
  packet.end_row = rows_.size();
  for (int lane = 0; lane < packet.count; ++lane) {
    samples_[packet.sample[lane]].own = segments.of(lane);
    counts.steps += segments.steps[lane];
  }
  counts.rays += packet.count;
  packets_.push_back(packet);
  packet.count = 0;
}

/// Adds the four children, quarter-weight observations of what lies behind, unless there is nothing more.
void OpacityPackets::divide(const SampleView& view, std::size_t index, bool last) {
  Sample& sample = samples_[index];
  sample.ends = last || sample.own.transmittance < SegmentMarch::kNegligible * sample.own.likelihood;
  if (sample.ends) return;
  const Region region = sample.region;
  const std::size_t first = samples_.size();
  for (int c = 0; c < 4; ++c)
    if (const Region child = region.child(c); inside(view, child)) add(view, child);
  samples_[index].first_child = static_cast<int>(first);
  samples_[index].end_child = static_cast<int>(samples_.size());
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
      sample.behind = background_likelihood(options_.background, options_.model, stats_of(view, sample));
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
  PacketReach lanes;
  bool any_reach = false;
  for (int lane = 0; lane < packet.count; ++lane) {
    const Sample& sample = samples_[packet.sample[lane]];
    lanes.reach[lane] = sample.reach;
    lanes.z[lane] = sample.z;
    lanes.weight[lane] = sample.weight;
    any_reach |= sample.reach > 0;
  }
  if (!any_reach) return;
  march_.distribute(rows_.data() + packet.first_row, rows_.data() + packet.end_row, options_.ray_weights,
                    lanes);
  for (int lane = 0; lane < packet.count; ++lane)
    samples_[packet.sample[lane]].transmittance = lanes.transmittance[lane];
}

/// Hands what a sample's stretch leaves on to its children.
void OpacityPackets::hand_on(const Sample& sample) {
  if (sample.z <= 0) return;
  const float onward = sample.reach * sample.transmittance * sample.behind / sample.z;
  if (onward <= kNothing) return;
  for (int c = sample.first_child; c < sample.end_child; ++c) samples_[c].reach = onward;
}

}  // namespace roxel

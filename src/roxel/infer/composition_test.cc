/// Rays cut and composed again (docs/rays.md), marched one by one and in packets.

#include <gtest/gtest.h>

#include "roxel/infer/infer_fixture.h"
#include "roxel/infer/packet_march.h"
#include "roxel/infer/passes.h"

namespace roxel {
namespace {

using namespace fixture;

/// A volume of one brick of another, with what the brick's voxels hold.
struct Piece {
  Volume volume;
  std::vector<ColorTotals> totals;
  std::uint32_t first_slot;  ///< in the other
};

Piece piece_of(const Volume& whole, const std::vector<ColorTotals>& totals, const Brick& brick) {
  BrickMask mask;
  for (int v = 0; v < kBrickVoxels; ++v) mask[v] = brick.has(v);
  Topology topology(whole.index(0).frame());
  topology.insert_brick(brick.coord, mask);
  Piece piece{Volume({topology}), {}, brick.first_slot};
  for (std::uint32_t slot = 0; slot < brick.count(); ++slot) {
    piece.volume.tau[slot] = whole.tau[brick.first_slot + slot];
    piece.totals.push_back(totals[brick.first_slot + slot]);
  }
  return piece;
}

/// Bricks along a ray, in its order.
std::vector<std::uint32_t> bricks_along(const Volume& volume, const Ray& ray, Stretch range) {
  std::vector<std::uint32_t> bricks;
  const LatticeStack stack(volume);
  stack.walk(
      ray, range, [&](std::uint32_t brick) { bricks.push_back(brick); },
      [](const VoxelStep&, const VoxelPlace&) { return true; });
  return bricks;
}

class Composition : public ::testing::Test {
 protected:
  Composition() : random_(3), volume_(random_volume({3, 3, 3}, 0.7, 0.01, 0.6, random_)) {
    std::uniform_real_distribution<float> color(-30, 60), unit(0, 1);
    for (std::uint32_t slot = 0; slot < volume_.slot_count(); ++slot) {
      totals_.push_back({});
      const float m[3] = {color(random_), color(random_), color(random_)}, w = unit(random_);
      totals_.back()[0] = std::llrint(w * kColorUnit);
      for (int c = 0; c < 3; ++c) totals_.back()[1 + c] = std::llrint(w * m[c] * kColorUnit);
      const float second[6] = {m[0] * m[0], m[1] * m[1], m[2] * m[2], m[0] * m[1], m[0] * m[2], m[1] * m[2]};
      for (int c = 0; c < 6; ++c)
        totals_.back()[4 + c] = std::llrint(w * (second[c] + (c < 3 ? 300 : 0)) * kColorUnit);
    }
    const PinholeCamera camera = camera_at({-14, 31, -11}, {12, 12, 12}, 16, 20);
    view_ = view_of(camera, random_image(16, random_), plan_of({1, 80}, 0));
  }

  Segment march(const Ray& ray, const RegionStats& sample, Stretch range, EvaluatedSteps& steps) {
    return march(volume_, totals_, ray, sample, range, steps);
  }

  Segment march(const Volume& volume, const std::vector<ColorTotals>& totals, const Ray& ray,
                const RegionStats& sample, Stretch range, EvaluatedSteps& steps, bool early_stop = false) {
    const LatticeStack stack(volume);
    NodeScratch scratch(stack, volume.tau);
    scratch.compare_with(totals);
    SegmentMarch march(stack, scratch, model_, background_, filters_);
    march.set_early_stop(early_stop);
    march.set_depths(true);
    RemovedColor removed;
    return march.march(view_, {0, 0, 0}, sample, ray, range, nullptr, removed, steps);
  }

  /// One pixel's ray through the whole volume.
  Segment march_alone(const Region& region, EvaluatedSteps& steps, bool early_stop = false) {
    return march(volume_, totals_, region_ray(view_, region), view_.pyramid->at(0, region.x, region.y),
                 view_.plan.range, steps, early_stop);
  }

  std::mt19937 random_;
  Volume volume_;
  std::vector<ColorTotals> totals_;
  SampleView view_;
  MatchModel model_;
  Background background_;
  SampleFilters filters_;
};

// Bricks may be anywhere: each marched alone and folded, they say what the whole volume says.
TEST_F(Composition, CutAtBrickPlanesARayIsTheSameBitForBit) {
  std::vector<Piece> pieces;
  for (const Brick& brick : volume_.index(0).bricks()) pieces.push_back(piece_of(volume_, totals_, brick));
  int cut_rays = 0;
  for (int pixel = 0; pixel < 256; ++pixel) {
    const int x = pixel % 16, y = pixel / 16;
    const RegionStats sample = view_.pyramid->at(0, x, y);
    const Ray ray = region_ray(view_, {0, x, y});
    EvaluatedSteps whole_steps, piece_steps;
    std::vector<std::uint32_t> piece_slots;
    const Segment whole = march(ray, sample, view_.plan.range, whole_steps);
    Segment folded;
    const std::vector<std::uint32_t> bricks = bricks_along(volume_, ray, view_.plan.range);
    for (const std::uint32_t brick : bricks) {
      const Piece& piece = pieces[brick];
      const std::size_t before = piece_steps.size();
      folded = folded.then(march(piece.volume, piece.totals, ray, sample, view_.plan.range, piece_steps));
      for (std::size_t s = before; s < piece_steps.size(); ++s)
        piece_slots.push_back(piece_steps[s].slot + piece.first_slot);
    }
    cut_rays += bricks.size() > 2;
    ASSERT_EQ(folded.transmittance, whole.transmittance);
    ASSERT_EQ(folded.likelihood, whole.likelihood);
    ASSERT_EQ(piece_steps.size(), whole_steps.size());
    for (std::size_t s = 0; s < whole_steps.size(); ++s) {
      ASSERT_EQ(piece_slots[s], whole_steps[s].slot);
      ASSERT_EQ(piece_steps[s].length, whole_steps[s].length);
      ASSERT_EQ(piece_steps.depth(s).middle, whole_steps.depth(s).middle);
      ASSERT_EQ(piece_steps.depth(s).half_chord, whole_steps.depth(s).half_chord);
      ASSERT_EQ(piece_steps[s].likelihood, whole_steps[s].likelihood);
      ASSERT_EQ(piece_steps[s].weight, whole_steps[s].weight);
    }
  }
  EXPECT_GT(cut_rays, 150);
}

TEST_F(Composition, CutAnywhereARayIsTheSameUpToRounding) {
  std::uniform_real_distribution<double> depth(10, 60);
  for (int pixel = 0; pixel < 256; ++pixel) {
    const int x = pixel % 16, y = pixel / 16;
    const RegionStats sample = view_.pyramid->at(0, x, y);
    const Ray ray = region_ray(view_, {0, x, y});
    const double cut = depth(random_);
    EvaluatedSteps steps;
    const Segment whole = march(ray, sample, view_.plan.range, steps);
    const Segment front = march(ray, sample, {view_.plan.range.begin, cut}, steps);
    const Segment back = march(ray, sample, {cut, view_.plan.range.end}, steps);
    const Segment folded = front.then(back);
    ASSERT_NEAR(folded.transmittance, whole.transmittance, 1e-5);
    ASSERT_NEAR(folded.likelihood, whole.likelihood, 1e-5);
  }
}

TEST_F(Composition, StoppingEarlyLeavesOutLessThanItsBound) {
  for (float& tau : volume_.tau) tau = 3;
  int stopped = 0;
  for (int pixel = 0; pixel < 256; ++pixel) {
    const int x = pixel % 16, y = pixel / 16;
    const RegionStats sample = view_.pyramid->at(0, x, y);
    const Ray ray = region_ray(view_, {0, x, y});
    EvaluatedSteps all, some;
    const Segment whole = march(ray, sample, view_.plan.range, all);
    const LatticeStack stack(volume_);
    NodeScratch scratch(stack, volume_.tau);
    scratch.compare_with(totals_);
    SegmentMarch march(stack, scratch, model_, background_, filters_);
    RemovedColor removed;
    const Segment early =
        march.march(view_, {0, x, y}, sample, ray, view_.plan.range, nullptr, removed, some);
    stopped += some.size() < all.size();
    // Likelihoods are at most 1 + outlier, so what lies behind adds at most T < kNegligible Z.
    ASSERT_LE(early.likelihood, whole.likelihood * (1 + 1e-6));
    ASSERT_GE(early.likelihood * (1 + SegmentMarch::kNegligible) * (1 + 1e-6), whole.likelihood);
    ASSERT_LE(std::abs(early.transmittance - whole.transmittance),
              SegmentMarch::kNegligible * early.likelihood + 1e-7);
  }
  EXPECT_GT(stopped, 50);
}

/// Neighbouring pixels, four a row from (x, y) on.
struct Neighbours {
  int x, y;
  static int rows() { return std::max(PacketWalk::rays() / 4, 1); }
  static std::vector<Neighbours> all(int size) {
    std::vector<Neighbours> blocks;
    for (int y = 0; y + rows() <= size; y += rows())
      for (int x = 0; x < size; x += 4) blocks.push_back({x, y});
    return blocks;
  }
  Region region(int ray) const { return {0, x + ray % 4, y + ray / 4}; }
};

class PacketComposition : public Composition {
 protected:
  struct Step {
    std::uint32_t slot;
    float length, weight, mean_path;
    float share;   ///< of the likelihood
    float before;  ///< what the steps before have of it

    bool operator==(const Step&) const = default;
  };
  /// Of one ray: what came out and the steps.
  struct Lane {
    Segment segment;
    std::vector<Step> steps;
  };

  /// Marches the neighbours that `with` lets through, as one packet.
  std::vector<Lane> march_packet(const Volume& volume, const std::vector<ColorTotals>& totals,
                                 const Neighbours& neighbours, unsigned with = 0xffff) {
    const LatticeStack stack(volume);
    NodeScratch scratch(stack, volume.tau);
    scratch.compare_with(totals);
    PacketMarch march(stack, scratch, model_);
    PacketTerms terms;
    const std::vector<std::uint32_t> bricks = in_order(stack);
    march.begin(view_.camera.pose.centre, view_.plan.range, bricks);
    for (int ray = 0; ray < PacketWalk::rays(); ++ray) {
      const Region region = neighbours.region(ray);
      terms.set(ray, sample_terms(view_.pyramid->at(0, region.x, region.y), model_));
      if (with >> ray & 1) march.add(ray, region_ray(view_, region).direction);
    }
    PacketRecord record;
    const PacketSegments segments = march.march(PacketWalk::rays(), terms, record);
    std::vector<Lane> lanes(PacketWalk::rays());
    for (int ray = 0; ray < PacketWalk::rays(); ++ray)
      lanes[ray].segment = {segments.transmittance[ray], segments.likelihood[ray]};
    for (std::size_t s = 0; s < record.size(); ++s)
      lanes[record.ray()[s]].steps.push_back({record.slot()[s], record.length()[s], record.weight()[s],
                                              record.mean_path()[s], record.share()[s], record.before()[s]});
    return lanes;
  }

  /// The volume's bricks, nearest to the camera first, face by face.
  std::vector<std::uint32_t> in_order(const LatticeStack& stack) const {
    std::vector<std::pair<int, std::uint32_t>> sorted;
    const Eigen::Vector3i at = (view_.camera.pose.centre / kBrickSide).array().floor().cast<int>();
    for (std::uint32_t b = 0; b < stack.brick_count(); ++b)
      sorted.emplace_back((stack.brick(b).coord - at).cwiseAbs().sum(), b);
    std::sort(sorted.begin(), sorted.end());
    std::vector<std::uint32_t> bricks;
    for (const auto& [distance, brick] : sorted) bricks.push_back(brick);
    return bricks;
  }
};

TEST_F(PacketComposition, LanesSayWhatSingleRaysSay) {
  for (const Neighbours& neighbours : Neighbours::all(16)) {
    const std::vector<Lane> lanes = march_packet(volume_, totals_, neighbours);
    for (int ray = 0; ray < PacketWalk::rays(); ++ray) {
      EvaluatedSteps steps;
      const Segment single = march_alone(neighbours.region(ray), steps);
      const Lane& lane = lanes[ray];
      ASSERT_NEAR(lane.segment.transmittance, single.transmittance, 1e-5);
      ASSERT_NEAR(lane.segment.likelihood, single.likelihood, 1e-5 * (1 + single.likelihood));
      ASSERT_EQ(lane.steps.size(), steps.size());
      Segment before;
      for (std::size_t s = 0; s < steps.size(); ++s) {
        const EvaluatedStep step = steps[s];
        const float share = before.transmittance * step.opacity * step.likelihood;
        ASSERT_EQ(lane.steps[s].slot, step.slot);
        ASSERT_NEAR(lane.steps[s].length, step.length, 1e-6);
        ASSERT_NEAR(lane.steps[s].weight, step.weight, 2e-5);
        ASSERT_NEAR(lane.steps[s].mean_path, step.mean_path, 1e-5 * step.mean_path + 1e-7);
        ASSERT_NEAR(lane.steps[s].share, share, 3e-5 * share + 1e-9);
        ASSERT_NEAR(lane.steps[s].before, before.likelihood, 3e-5 * before.likelihood + 1e-9);
        before.append(step.opacity, step.likelihood);
      }
    }
  }
}

// Which rays share a packet is nobody's business: the same bits alone as among others.
TEST_F(PacketComposition, ALaneDoesNotDependOnTheOthers) {
  for (const Neighbours& neighbours : Neighbours::all(16)) {
    const std::vector<Lane> together = march_packet(volume_, totals_, neighbours);
    for (int ray = 0; ray < PacketWalk::rays(); ++ray) {
      const Lane alone = march_packet(volume_, totals_, neighbours, 1u << ray)[ray];
      ASSERT_EQ(alone.segment.transmittance, together[ray].segment.transmittance);
      ASSERT_EQ(alone.segment.likelihood, together[ray].segment.likelihood);
      ASSERT_EQ(alone.steps, together[ray].steps);
    }
  }
}

TEST_F(PacketComposition, CutAtBrickPlanesLanesAreTheSameBitForBit) {
  for (float& tau : volume_.tau) tau *= 0.1f;  // no ray may stop early in the whole and not in its parts
  std::vector<Piece> pieces;
  for (const Brick& brick : volume_.index(0).bricks()) pieces.push_back(piece_of(volume_, totals_, brick));
  for (const Neighbours& neighbours : Neighbours::all(16)) {
    const std::vector<Lane> whole = march_packet(volume_, totals_, neighbours);
    std::vector<std::vector<Lane>> parts;
    for (const Piece& piece : pieces) parts.push_back(march_packet(piece.volume, piece.totals, neighbours));
    for (int ray = 0; ray < PacketWalk::rays(); ++ray) {
      Segment folded;
      std::size_t next = 0;
      for (const std::uint32_t brick :
           bricks_along(volume_, region_ray(view_, neighbours.region(ray)), view_.plan.range)) {
        const Lane& part = parts[brick][ray];
        folded = folded.then(part.segment);
        for (const Step& step : part.steps) {
          const Step& of_whole = whole[ray].steps.at(next++);
          ASSERT_EQ(of_whole.slot, step.slot + pieces[brick].first_slot);
          ASSERT_EQ(of_whole.length, step.length);
          ASSERT_EQ(of_whole.weight, step.weight);
          ASSERT_EQ(of_whole.mean_path, step.mean_path);
        }
      }
      ASSERT_EQ(next, whole[ray].steps.size());
      ASSERT_EQ(folded.transmittance, whole[ray].segment.transmittance);
      ASSERT_EQ(folded.likelihood, whole[ray].segment.likelihood);
    }
  }
}

TEST_F(PacketComposition, LanesStopWhereSingleRaysStop) {
  for (float& tau : volume_.tau) tau = 3;
  int stopped = 0;
  for (const Neighbours& neighbours : Neighbours::all(16)) {
    const std::vector<Lane> lanes = march_packet(volume_, totals_, neighbours);
    for (int ray = 0; ray < PacketWalk::rays(); ++ray) {
      EvaluatedSteps all, some;
      march_alone(neighbours.region(ray), all);
      march_alone(neighbours.region(ray), some, true);
      stopped += some.size() < all.size();
      ASSERT_EQ(lanes[ray].steps.size(), some.size());
    }
  }
  EXPECT_GT(stopped, 50);
}

// What is behind an opaque voxel is not looked at again by four children.
TEST(OpacityMarch, SpentSamplesDoNotDivide) {
  std::mt19937 random(4);
  Volume volume = random_volume({1, 1, 1}, 1, 0.01, 0.02, random);
  const PinholeCamera camera = camera_at({4, 4, -16}, {4, 4, 4}, 8, 24);
  const SampleView view = view_of(camera, random_image(8, random), plan_of({1, 60}, 1, {20.0}));
  const std::vector<ColorTotals> totals(volume.slot_count());
  const auto rays = [&] {
    const LatticeStack stack(volume);
    NodeScratch scratch(stack, volume.tau);
    scratch.compare_with(totals);
    return march_opacity(stack, {view}, MarchOptions{}, RunContext(1), scratch).rays;
  };
  EXPECT_EQ(rays(), 16 + 64);
  for (float& tau : volume.tau) tau = 20;
  EXPECT_EQ(rays(), 16);
}

}  // namespace
}  // namespace roxel

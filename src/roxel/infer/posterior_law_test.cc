// What the posterior rule promises as an algorithm (docs/passes.md): it is an EM step.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "roxel/infer/infer_fixture.h"

namespace roxel {
namespace {

using fixture::nodes_around;
using fixture::random_volume;

/// A volume and its photographs, with the colours and the prior's field held: passes move tau alone.
class HeldColors {
 public:
  HeldColors(Volume volume, std::vector<SampleNode> nodes, const MarchOptions& options)
      : volume_(std::move(volume)),
        nodes_(std::move(nodes)),
        options_(options),
        stack_(volume_),
        scratch_(stack_, volume_.tau),
        collected_(volume_.slot_count(), 1, 0) {
    PassOptions everywhere;
    everywhere.opacity = options;
    everywhere.everywhere = true;
    collect_color(stack_, nodes_, everywhere, context_, nullptr, collected_);
  }

  /// Sums of the opacity pass at the current tau; returns the log-likelihood.
  double march() {
    totals_.clear_opacity();
    PassCounts counts;
    for (const SampleNode& node : nodes_) {
      scratch_.reset();
      scratch_.compare_with(totals_.color);
      counts += march_opacity(stack_, node, options_, context_, scratch_);
      totals_.add_opacity(stack_, scratch_);
    }
    weight_ = counts.observation_weight;
    return counts.log_likelihood;
  }
  void update(const std::vector<float>& prior_opacity, double strength) {
    update_opacity(UpdateRule::kPosterior, totals_, prior_opacity, strength, 1, volume_);
  }

  double hits(std::uint32_t slot) const { return totals_.opacity[slot][0] / kOpacityUnit; }
  double exposure(std::uint32_t slot) const { return totals_.opacity[slot][1] / kOpacityUnit; }
  double weight() const { return weight_; }
  Volume& volume() { return volume_; }

 private:
  RunContext context_{1};
  Volume volume_;
  std::vector<SampleNode> nodes_;
  MarchOptions options_;
  LatticeStack stack_;
  NodeScratch scratch_;
  CollectedColors collected_;
  Totals& totals_ = collected_.totals;
  double weight_ = 0;
};

/// Logarithm of a Gamma prior of mode tau_0 and strength beta, up to a constant.
double log_prior(const Volume& volume, const std::vector<float>& prior_opacity, double strength) {
  double sum = 0;
  for (std::uint32_t slot = 0; slot < volume.slot_count(); ++slot) {
    const double tau_0 = -std::log1p(-static_cast<double>(prior_opacity[slot]));
    if (strength > 0) sum += strength * (tau_0 * std::log(volume.tau[slot]) - volume.tau[slot]);
  }
  return sum;
}

constexpr int kPasses = 12;

struct Drawn {
  int divisions, views;
  double strength, largest_tau;
  BackgroundKind background;
  unsigned seed;

  static Drawn draw() {
    Drawn drawn;
    drawn.divisions = *rc::gen::inRange(0, 3);
    drawn.views = *rc::gen::inRange(1, 5);
    drawn.strength = *rc::gen::element(0.0, 0.5, 5.0);
    drawn.largest_tau = *rc::gen::element(0.1, 1.0, 10.0);
    drawn.background =
        *rc::gen::element(BackgroundKind::kNone, BackgroundKind::kUnknown, BackgroundKind::kKnown);
    drawn.seed = *rc::gen::inRange(0u, 1u << 30);
    return drawn;
  }
};

RC_GTEST_PROP(PosteriorPass, NeverLowersLikelihoodTimesPrior, ()) {
  const Drawn drawn = Drawn::draw();
  std::mt19937 random(drawn.seed);
  Volume volume = random_volume({1, 1, 1}, 0.6, 0.005, drawn.largest_tau, random);
  std::uniform_real_distribution<float> opacity(0.005f, 0.6f);
  std::vector<float> field(volume.slot_count());
  for (float& alpha : field) alpha = opacity(random);
  std::vector<SampleNode> nodes = nodes_around(volume, drawn.views, 8, drawn.divisions, random);
  MarchOptions options;
  options.background.kind = drawn.background;
  options.background.mean[0] = 50;
  HeldColors held(std::move(volume), std::move(nodes), options);

  double last = -std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < kPasses; ++pass) {
    const double now = held.march() + log_prior(held.volume(), field, drawn.strength);
    // A ray may leave out kNegligible of its likelihood (early stop); its logarithm is a float of order 10,
    // rounded to 1e-6; tau is a float, and sums are rounded to 2^-21, which the prior's gradient makes at
    // most 1e-5 a voxel.
    const double tolerance = held.weight() * (SegmentMarch::kNegligible + 2e-6) + 1e-5 * field.size();
    RC_ASSERT(now >= last - tolerance);
    last = now;
    held.update(field, drawn.strength);
  }
}

// The sums are exact derivatives: d log Z / d tau_v = hits / tau_v - exposure (Fisher's identity). That is
// what makes the update an ascent, and it pins every term: mean paths, reach, quarter weights.
TEST(PosteriorPass, SumsAreTheGradientOfTheLogLikelihood) {
  for (const int divisions : {0, 1, 2}) {
    std::mt19937 random(40 + divisions);
    Volume volume = random_volume({1, 1, 1}, 0.5, 0.02, 0.5, random);
    std::vector<SampleNode> nodes = nodes_around(volume, 2, 8, divisions, random);
    HeldColors held(std::move(volume), std::move(nodes), {});
    held.march();
    std::vector<std::uint32_t> tested;
    for (std::uint32_t slot = 0; slot < held.volume().slot_count() && tested.size() < 25; slot += 3)
      if (held.hits(slot) > 0.02) tested.push_back(slot);
    ASSERT_GE(tested.size(), 10u);
    for (const std::uint32_t slot : tested) {
      held.march();
      float& tau = held.volume().tau[slot];
      const float there = tau;
      const double gradient = held.hits(slot) / there - held.exposure(slot);
      const double scale = held.hits(slot) / there + held.exposure(slot);
      const float h = 0.05f * there;
      tau = there + h;
      const double above = held.march();
      tau = there - h;
      const double below = held.march();
      tau = there;
      // The step's third-order term is about 0.05^2 / 3 of the scale; the logarithms' rounding, 1e-6 a ray,
      // does less.
      EXPECT_NEAR((above - below) / (2 * h), gradient, 4e-3 * scale + 2e-4 / h) << divisions << " " << slot;
    }
  }
}

// At rest the update returns what it was given: hits / tau = exposure for every voxel that rays reach.
TEST(PosteriorPass, ComesToRestAtAStationaryPoint) {
  std::mt19937 random(50);
  Volume volume = random_volume({1, 1, 1}, 0.3, 0.05, 0.5, random);
  std::vector<SampleNode> nodes = nodes_around(volume, 3, 8, 0, random);
  const std::vector<float> field(volume.slot_count(), 0.1f);
  HeldColors held(std::move(volume), std::move(nodes), {});
  for (int pass = 0; pass < 300; ++pass) {
    held.march();
    held.update(field, 5);
  }
  const std::vector<float> before = held.volume().tau;
  held.march();
  held.update(field, 5);
  for (std::uint32_t slot = 0; slot < before.size(); ++slot)
    EXPECT_NEAR(held.volume().tau[slot], before[slot], 1e-3 * (1 + before[slot])) << slot;
}

}  // namespace
}  // namespace roxel

/// What merge() promises (roxel/volume/merge.h), held against real passes: nodes that speak in two volumes,
/// merged, say what they say in one.

#include <gtest/gtest.h>

#include "roxel/infer/infer_fixture.h"
#include "roxel/volume/merge.h"

namespace roxel {
namespace {

using namespace fixture;

class MergeLaw : public ::testing::TestWithParam<UpdateRule> {
 protected:
  MergeLaw()
      : start_(random_volume({2, 2, 2}, 0.8, 0.02, 1, random_)),
        nodes_(nodes_around(start_, 5, 24, 1, random_)) {
    options_.opacity.rule = GetParam();
    options_.everywhere = true;
  }

  MergeOptions merge_options() const {
    MergeOptions options;
    options.rule = GetParam() == UpdateRule::kRoxels ? SupportRule::kRoxels : SupportRule::kPosterior;
    options.prior_strength = options_.prior.strength;
    return options;
  }

  /// A pass in which only nodes [first, last) speak; all are compared with the colours of all five.
  Volume pass_of(std::size_t first, std::size_t last) {
    const RunContext context(1);
    const LatticeStack stack(start_);
    CollectedColors held(start_.slot_count(), nodes_.size(), options_.kept_color_bytes);
    collect_color(stack, nodes_, options_, context, nullptr, held);
    Totals totals(start_.slot_count());
    for (std::size_t n = first; n < last; ++n) {
      NodeScratch scratch(stack, start_.tau);
      const SampleNode views = resident(nodes_[n]);
      compare_with_others(stack, views, n, options_, held, context, scratch);
      march_opacity(stack, views, options_.opacity, context, scratch);
      totals.add_opacity(stack, scratch);
    }
    const std::vector<SampleNode> speaking(nodes_.begin() + first, nodes_.begin() + last);
    CollectedColors own(start_.slot_count(), speaking.size(), 0);
    collect_color(stack, speaking, options_, context, nullptr, own);
    Volume volume = start_;
    update_opacity(GetParam(), totals, prior_opacity_field(start_, options_.prior, 1),
                   options_.prior.strength, 1, volume);
    update_color(own.totals.color, 1, volume);
    return volume;
  }

  std::mt19937 random_{8};
  Volume start_;
  std::vector<SampleNode> nodes_;
  PassOptions options_;
};

// The nodes that speak apart are those of run_pass: all of them at once are its pass, bit for bit.
TEST_P(MergeLaw, AllNodesTogetherAreAPass) {
  const Volume together = pass_of(0, 5);
  Volume passed = start_;
  run_pass(nodes_, options_, RunContext(1), nullptr, passed);
  EXPECT_EQ(together.tau, passed.tau);
  EXPECT_EQ(together.support, passed.support);
  EXPECT_EQ(together.confidence, passed.confidence);
  EXPECT_EQ(together.color_mean, passed.color_mean);
  EXPECT_EQ(together.color_weight, passed.color_weight);
}

// Volumes hold floats (relative rounding 6e-8). Solving tau for the prior and back keeps it within a few
// roundings of the largest support, and 1 - c of a voxel that five nodes look at is at least 2/7; colours are
// squares of up to 100.
TEST_P(MergeLaw, TwoPassesMergedAreOneJointPass) {
  Volume joint = start_;
  run_pass(nodes_, options_, RunContext(1), nullptr, joint);
  const Volume first = pass_of(0, 2), second = pass_of(2, 5);
  const Volume merged = merge({&first, &second}, merge_options());
  ASSERT_EQ(merged.slot_count(), joint.slot_count());
  int moved = 0, in_both = 0;
  for (std::uint32_t s = 0; s < joint.slot_count(); ++s) {
    SCOPED_TRACE(s);
    const float most = joint.support[s][0] + joint.support[s][1];
    ASSERT_NEAR(merged.tau[s], joint.tau[s], 1e-6 * (1 + most) * (1 + joint.tau[s]));
    ASSERT_NEAR(merged.support[s][0], joint.support[s][0], 1e-6 * (1 + most));
    ASSERT_NEAR(merged.support[s][1], joint.support[s][1], 1e-6 * (1 + most));
    ASSERT_NEAR(merged.confidence[s], joint.confidence[s], 1e-6);
    ASSERT_NEAR(merged.color_weight[s], joint.color_weight[s], 1e-5);
    if (joint.color_weight[s] > 1e-3f) {
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(merged.color_mean[s][c], joint.color_mean[s][c], 1e-3);
      const std::array<float, 6> once = merged.color_cov[s].unpacked(),
                                 at_once = joint.color_cov[s].unpacked();
      const float spread = std::max({at_once[0], at_once[1], at_once[2]});
      for (int c = 0; c < 6; ++c) ASSERT_NEAR(once[c], at_once[c], 0.02 + 4e-3 * spread);
    }
    moved += std::abs(joint.tau[s] - first.tau[s]) > 0.01f * joint.tau[s];
    in_both += first.color_weight[s] > 0 && second.color_weight[s] > 0;
  }
  EXPECT_GT(moved, static_cast<int>(joint.slot_count() / 4)) << "one part alone is not the whole";
  EXPECT_GT(in_both, static_cast<int>(joint.slot_count() / 2));
}

INSTANTIATE_TEST_SUITE_P(Rules, MergeLaw, ::testing::Values(UpdateRule::kPosterior, UpdateRule::kRoxels),
                         [](const auto& test) {
                           return std::string(test.param == UpdateRule::kRoxels ? "Roxels" : "Posterior");
                         });

}  // namespace
}  // namespace roxel

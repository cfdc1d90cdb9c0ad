#include "roxel/solve/estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "roxel/solve/cube_fixture.h"
#include "roxel/solve/reconstruct.h"

namespace roxel {
namespace {

using fixture::cube_dataset;
using fixture::cube_loader;

ReconstructOptions options_at(int resolution) {
  ReconstructOptions options;
  options.bounds = {-0.8, -0.8, -0.8, 0.8, 0.8, 0.8};
  options.resolution = resolution;
  options.levels = 2;
  options.passes = 8;
  return options;
}

CostEstimate estimated(const Dataset& dataset, const ReconstructOptions& options, int threads = 2) {
  return estimate_cost(dataset, lay_out(dataset, cube_loader(), options), options, threads);
}

// The promise is "about a factor of 2" on real scenes; the small cube, on which a ray crosses more of the
// surface's thickness, is not among those that the factors were measured on.
TEST(EstimateCost, VoxelsAndStepsAreRoughlyThoseOfTheRun) {
  const Dataset dataset = cube_dataset(12, 96);
  ReconstructOptions options = options_at(64);
  options.all_passes = true;
  RunContext context(2);
  const Reconstruction run =
      reconstruct(dataset, cube_loader(std::array{0.0f, 0.0f, 0.0f}, true), options, context);
  const CostEstimate estimate = estimated(dataset, options);
  ASSERT_EQ(estimate.levels.size(), run.summary.levels.size());
  for (std::size_t level = 0; level < estimate.levels.size(); ++level) {
    const LevelRecord& found = run.summary.levels[level];
    const double voxels = static_cast<double>(found.voxels_in_box + found.voxels_around);
    EXPECT_DOUBLE_EQ(estimate.levels[level].voxel_size, found.voxel_size);
    EXPECT_GT(estimate.levels[level].voxels, voxels / 3) << level;
    EXPECT_LT(estimate.levels[level].voxels, voxels * 3) << level;
  }
  const double steps = static_cast<double>(run.summary.passes.back().steps);
  EXPECT_GT(estimate.levels.back().steps_per_pass, steps / 4);
  EXPECT_LT(estimate.levels.back().steps_per_pass, steps * 4);
}

TEST(EstimateCost, GrowsWithWhatIsAskedFor) {
  const Dataset few = cube_dataset(6, 96), many = cube_dataset(24, 96), large = cube_dataset(6, 384);
  const CostEstimate base = estimated(few, options_at(64));
  EXPECT_GT(base.memory.peak_bytes, 1e8);
  EXPECT_GT(base.seconds, 0);
  EXPECT_GT(estimated(large, options_at(128)).seconds, 2 * estimated(large, options_at(64)).seconds);
  EXPECT_GT(estimated(few, options_at(128)).memory.peak_bytes, base.memory.peak_bytes);
  EXPECT_GT(estimated(many, options_at(64)).seconds, 3 * base.seconds);
  EXPECT_GT(estimated(many, options_at(64)).memory.peak_bytes, base.memory.peak_bytes);
  EXPECT_GT(estimated(large, options_at(64)).memory.peak_bytes, base.memory.peak_bytes);
  ReconstructOptions more_passes = options_at(64);
  more_passes.passes = 32;
  EXPECT_GT(estimated(few, more_passes).seconds, 1.5 * base.seconds);
  Scene surrounded = lay_out(few, cube_loader(), options_at(64));
  surrounded.surround_count = 4;
  const CostEstimate with_surround = estimate_cost(few, surrounded, options_at(64), 2);
  EXPECT_GT(with_surround.levels.back().voxels, base.levels.back().voxels);
  EXPECT_GT(with_surround.levels.back().steps_per_pass, base.levels.back().steps_per_pass);
  ReconstructOptions coarse = options_at(64), finest = coarse, both = coarse;
  coarse.coarse_passes = both.passes = finest.passes = 24;
  finest.coarse_passes = 8;
  const double of_coarse = estimated(few, coarse).seconds - base.seconds;
  const double of_finest = estimated(few, finest).seconds - base.seconds;
  EXPECT_GT(of_coarse, 0);
  EXPECT_GT(of_finest, 0);
  EXPECT_NEAR(estimated(few, both).seconds - base.seconds, of_coarse + of_finest, 1e-9);
}

TEST(EstimateCost, ThreadsDivideTimeAndAddScratch) {
  const Dataset dataset = cube_dataset(6, 96);
  const CostEstimate one = estimated(dataset, options_at(64), 1),
                     four = estimated(dataset, options_at(64), 4);
  EXPECT_DOUBLE_EQ(four.seconds, one.seconds / 4);
  EXPECT_GT(four.memory.peak_bytes, one.memory.peak_bytes);
}

/// The plan for `options` where `memory` bytes may be had.
MemoryPlan plan_within(double memory, const Dataset& dataset, ReconstructOptions options, int threads = 2) {
  options.memory = memory / (1024.0 * 1024 * 1024);
  return plan_memory(dataset, lay_out(dataset, cube_loader(), options), options, threads);
}

// Samples go before colours that are kept: what a pass cannot do without goes last, and is then said.
TEST(PlanMemory, GivesUpWhatOnlySavesTimeFirst) {
  const Dataset dataset = cube_dataset(64, 512);
  const ReconstructOptions options = options_at(64);
  const MemoryPlan ample = plan_within(64e9, dataset, options);
  EXPECT_TRUE(ample.fits);
  EXPECT_TRUE(std::isinf(ample.sample_bytes));
  EXPECT_EQ(ample.kept_color_bytes, MemoryPlan().kept_color_bytes);
  double last_samples = ample.sample_bytes, last_peak = ample.peak_bytes;
  int last_workers = ample.workers;
  bool samples_given_up = false, fits = true;
  for (double memory = ample.peak_bytes; fits; memory *= 0.97) {
    const MemoryPlan plan = plan_within(memory, dataset, options);
    fits = plan.fits;
    if (fits) {
      EXPECT_LE(plan.peak_bytes, memory * 1.000001);
    }
    // Fewer threads at once leave room for more samples.
    if (plan.workers == last_workers) {
      EXPECT_LE(plan.sample_bytes, last_samples);
    }
    EXPECT_LE(plan.peak_bytes, last_peak * 1.1);  // nodes in flight are more than what is given up, at first
    last_workers = plan.workers;
    last_samples = plan.sample_bytes;
    last_peak = plan.peak_bytes;
    samples_given_up |= plan.sample_bytes < 1e6;
  }
  EXPECT_TRUE(samples_given_up);
  EXPECT_LT(last_peak, 0.8 * ample.peak_bytes);
}

// Of eight threads that march at once, each takes 64 bytes a voxel: as few do as the memory has room for.
TEST(PlanMemory, FewerThreadsMarchAtOnceBeforeARunIsRefused) {
  const Dataset dataset = cube_dataset(6, 96);
  const ReconstructOptions options = options_at(256);
  const MemoryPlan ample = plan_within(64e9, dataset, options, 8);
  EXPECT_EQ(ample.workers, MemoryPlan().workers);
  int last = 8;
  std::set<int> counts;
  for (double memory = ample.peak_bytes;; memory *= 0.95) {
    const MemoryPlan plan = plan_within(memory, dataset, options, 8);
    const int workers = std::min(plan.workers, 8);
    EXPECT_LE(workers, last);
    if (!plan.fits) break;
    EXPECT_LE(plan.peak_bytes, memory * 1.000001);
    counts.insert(last = workers);
  }
  EXPECT_EQ(*counts.begin(), 1);
  EXPECT_GT(counts.size(), 3u);
}

// 102 x 102 squares of 13 bytes a photograph of 512 pixels a side, and the margin.
TEST(PlanMemory, CountsTheSmallPhotographsThatGainsAreFittedTo) {
  const Dataset dataset = cube_dataset(64, 512);
  ReconstructOptions options = options_at(64);
  options.illumination = IlluminationChoice::kNone;
  const double none = plan_within(64e9, dataset, options).peak_bytes;
  options.illumination = IlluminationChoice::kGain;
  EXPECT_NEAR(plan_within(64e9, dataset, options).peak_bytes - none, 1.15 * 64 * 102 * 102 * 13, 1000);
}

TEST(PlanMemory, AShortageNamesAVoxelSizeThatFits) {
  const Dataset dataset = cube_dataset(12, 96);
  ReconstructOptions options = options_at(512);
  options.memory = 1;
  const Scene scene = lay_out(dataset, cube_loader(), options);
  const MemoryPlan plan = plan_memory(dataset, scene, options, 2);
  ASSERT_FALSE(plan.fits);
  const std::string text = memory_shortage(dataset, scene, options, 2);
  const std::string before = "--voxel-size ";
  ASSERT_NE(text.find(before), std::string::npos) << text;
  options.voxel_size =
      1.01 * std::stod(text.substr(text.find(before) + before.size()));  // four digits are said
  EXPECT_TRUE(plan_memory(dataset, lay_out(dataset, cube_loader(), options), options, 2).fits) << text;
  options.voxel_size = 0.9 * *options.voxel_size;
  EXPECT_FALSE(plan_memory(dataset, lay_out(dataset, cube_loader(), options), options, 2).fits) << text;
  options.memory = 0.1;
  EXPECT_NE(memory_shortage(dataset, scene, options, 2).find("no size of voxels"), std::string::npos);
}

TEST(PlanMemory, WithoutALimitItIsTheMachines) {
  EXPECT_GT(memory_at_hand(), 1e7);
  EXPECT_LT(memory_at_hand(), 1e17);
}

}  // namespace
}  // namespace roxel

#include "roxel/solve/estimate.h"

#include <gtest/gtest.h>

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
  EXPECT_GT(base.memory_bytes, 1e8);
  EXPECT_GT(base.seconds, 0);
  EXPECT_GT(estimated(large, options_at(128)).seconds, 2 * estimated(large, options_at(64)).seconds);
  EXPECT_GT(estimated(few, options_at(128)).memory_bytes, base.memory_bytes);
  EXPECT_GT(estimated(many, options_at(64)).seconds, 3 * base.seconds);
  EXPECT_GT(estimated(many, options_at(64)).memory_bytes, base.memory_bytes);
  EXPECT_GT(estimated(large, options_at(64)).memory_bytes, base.memory_bytes);
  ReconstructOptions more_passes = options_at(64);
  more_passes.passes = 32;
  EXPECT_GT(estimated(few, more_passes).seconds, 1.5 * base.seconds);
  Scene surrounded = lay_out(few, cube_loader(), options_at(64));
  surrounded.surround_count = 4;
  const CostEstimate with_surround = estimate_cost(few, surrounded, options_at(64), 2);
  EXPECT_GT(with_surround.levels.back().voxels, base.levels.back().voxels);
  EXPECT_GT(with_surround.levels.back().steps_per_pass, base.levels.back().steps_per_pass);
}

TEST(EstimateCost, ThreadsDivideTimeAndAddScratch) {
  const Dataset dataset = cube_dataset(6, 96);
  const CostEstimate one = estimated(dataset, options_at(64), 1),
                     four = estimated(dataset, options_at(64), 4);
  EXPECT_DOUBLE_EQ(four.seconds, one.seconds / 4);
  EXPECT_GT(four.memory_bytes, one.memory_bytes);
}

}  // namespace
}  // namespace roxel

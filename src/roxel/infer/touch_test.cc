#include "roxel/infer/touch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "roxel/base/error.h"
#include "roxel/infer/infer_fixture.h"
#include "roxel/march/ray_twin.h"

namespace roxel {
namespace {

using fixture::camera_at;
using fixture::plain_image;
using fixture::plan_of;
using fixture::view_of;

using Cell = std::array<int, 4>;  // lattice, i, j, k

/// Cells that object samples cross: for sure, and counting rays that only graze an edge.
struct Reached {
  std::set<Cell> surely, perhaps;
};

void touch_plainly(const std::vector<LatticeFrame>& frames, const SampleView& view, const Region& region,
                   double begin, Reached& reached) {
  const RegionStats sample = view.pyramid->at(region.level, region.x, region.y);
  if (sample.valid <= 0 || sample.foreground <= 0) return;
  const Stretch range = served_range(view, region, begin);
  if (range.end > range.begin)
    for (const TwinChord& chord : twin_chords(frames, region_ray(view, region), range)) {
      const Cell cell{chord.lattice, chord.ijk.x(), chord.ijk.y(), chord.ijk.z()};
      reached.perhaps.insert(cell);
      if (chord.length > 1e-6) reached.surely.insert(cell);
    }
  if (range.end >= view.plan.range.end) return;
  for (int c = 0; c < 4; ++c)
    if (inside(view, region.child(c)))
      touch_plainly(frames, view, region.child(c), std::max(range.begin, range.end), reached);
}

Reached reached_plainly(const std::vector<LatticeFrame>& frames, const std::vector<SampleNode>& nodes) {
  Reached reached;
  for (const SampleNode& node : nodes)
    for (const SampleView& view : node) {
      const int level = view.plan.root_level;
      for (int y = 0; y < view.pyramid->height(level); ++y)
        for (int x = 0; x < view.pyramid->width(level); ++x)
          touch_plainly(frames, view, {level, x, y}, view.plan.range.begin, reached);
    }
  return reached;
}

std::set<Cell> cells_of(const std::vector<Topology>& topologies) {
  std::set<Cell> cells;
  for (int k = 0; k < static_cast<int>(topologies.size()); ++k)
    topologies[k].for_each_brick([&](const Eigen::Vector3i& brick, const BrickMask& mask) {
      for (int v = 0; v < kBrickVoxels; ++v)
        if (mask[v])
          cells.insert({k, 8 * brick.x() + v % 8, 8 * brick.y() + v / 8 % 8, 8 * brick.z() + v / 64});
    });
  return cells;
}

void expect_reached(const std::vector<Topology>& got, const Reached& expected) {
  const std::set<Cell> cells = cells_of(got);
  EXPECT_TRUE(std::includes(cells.begin(), cells.end(), expected.surely.begin(), expected.surely.end()));
  EXPECT_TRUE(std::includes(expected.perhaps.begin(), expected.perhaps.end(), cells.begin(), cells.end()));
}

class ReachedVoxels : public ::testing::Test {
 protected:
  std::vector<LatticeFrame> frames_ =
      nested_frames({Eigen::Vector3d(-4, -4, -4), Eigen::Vector3d(4, 4, 4)}, 0.25, 1);
  PinholeCamera camera_ = camera_at({-3, 1, -14}, {0.3, 0.2, 0}, 16, 24);
  PinholeCamera other_ = camera_at({13, -2, 3}, {0.3, 0.2, 0}, 16, 24);
  Image image_ = plain_image(16, {50, 0, 0});
};

TEST_F(ReachedVoxels, AreThoseThatRaysCross) {
  const std::vector<SampleNode> nodes{{view_of(camera_, image_, plan_of({1, 40}, 0))},
                                      {view_of(other_, image_, plan_of({1, 40}, 0))}};
  expect_reached(reached_voxels(frames_, nodes, RunContext(1)), reached_plainly(frames_, nodes));
}

TEST_F(ReachedVoxels, FollowSamplesThatDivide) {
  const std::vector<SampleNode> nodes{{view_of(camera_, image_, plan_of({1, 40}, 2, {11, 14}))}};
  expect_reached(reached_voxels(frames_, nodes, RunContext(1)), reached_plainly(frames_, nodes));
}

TEST_F(ReachedVoxels, EndWithTheRange) {
  const std::vector<SampleNode> nodes{{view_of(camera_, image_, plan_of({12, 13.5}, 0))}};
  const std::vector<Topology> got = reached_voxels(frames_, nodes, RunContext(1));
  expect_reached(got, reached_plainly(frames_, nodes));
  EXPECT_GT(got[0].voxel_count(), 0);
}

// A telephoto camera sees a thin pencil of a large box: only that exists.
TEST_F(ReachedVoxels, MemoryFollowsRaysNotTheBox) {
  const PinholeCamera narrow = camera_at({-3, 1, -14}, {0.3, 0.2, 0}, 16, 1000);
  const std::vector<SampleNode> nodes{{view_of(narrow, image_, plan_of({1, 40}, 0))}};
  const std::vector<Topology> got = reached_voxels(frames_, nodes, RunContext(1));
  const std::int64_t all = frames_[0].size_in_voxels().prod();
  EXPECT_GT(got[0].voxel_count(), 30);
  EXPECT_LT(got[0].voxel_count(), all / 50);
}

TEST_F(ReachedVoxels, MasksCreateNothingInTheBackground) {
  Mask foreground(16, 16, 0);
  for (int y = 5; y < 9; ++y)
    for (int x = 3; x < 7; ++x) foreground.at(x, y) = 255;
  for (const int divisions : {0, 1}) {
    const SamplePlan plan = divisions ? plan_of({1, 40}, 1, {13}) : plan_of({1, 40}, 0);
    const std::vector<SampleNode> nodes{{view_of(camera_, image_, plan, {}, foreground)}};
    const std::vector<Topology> got = reached_voxels(frames_, nodes, RunContext(1));
    expect_reached(got, reached_plainly(frames_, nodes));
    const std::vector<SampleNode> unmasked{{view_of(camera_, image_, plan)}};
    EXPECT_LT(got[0].voxel_count(), reached_voxels(frames_, unmasked, RunContext(1))[0].voxel_count() / 4);
  }
  const std::vector<SampleNode> nothing{{view_of(camera_, image_, plan_of({1, 40}, 0), {}, Mask(16, 16, 0))}};
  EXPECT_TRUE(cells_of(reached_voxels(frames_, nothing, RunContext(1))).empty());
}

TEST_F(ReachedVoxels, UnusablePixelsCreateNothing) {
  Mask valid(16, 16, 0);
  valid.at(7, 7) = 255;
  const std::vector<SampleNode> nodes{{view_of(camera_, image_, plan_of({1, 40}, 0), valid)}};
  const std::vector<Topology> got = reached_voxels(frames_, nodes, RunContext(1));
  expect_reached(got, reached_plainly(frames_, nodes));
  EXPECT_LT(got[0].voxel_count(), 100);
}

TEST_F(ReachedVoxels, DoNotDependOnThreads) {
  const std::vector<SampleNode> nodes{
      {view_of(camera_, image_, plan_of({1, 40}, 1, {13}))},
      {view_of(other_, image_, plan_of({1, 40}, 0))},
      {view_of(camera_at({0, 14, 1}, {0, 0, 0}, 16, 20, {1, 0, 0}), image_, plan_of({1, 40}, 0))}};
  const std::set<Cell> one = cells_of(reached_voxels(frames_, nodes, RunContext(1)));
  for (const int threads : {2, 4})
    EXPECT_EQ(cells_of(reached_voxels(frames_, nodes, RunContext(threads))), one);
}

TEST_F(ReachedVoxels, StopsWhenCancelled) {
  RunContext context(2);
  context.cancel();
  const std::vector<SampleNode> nodes{{view_of(camera_, image_, plan_of({1, 40}, 0))}};
  EXPECT_THROW(reached_voxels(frames_, nodes, context), Cancelled);
}

}  // namespace
}  // namespace roxel

#include "roxel/infer/overlap.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "roxel/base/error.h"
#include "roxel/infer/infer_fixture.h"

namespace roxel {
namespace {

using fixture::camera_at;
using fixture::plain_image;
using fixture::plan_of;
using fixture::view_of;

constexpr Stretch kRange{1, 60};
const Eigen::AlignedBox3d kBox(Eigen::Vector3d(-4, -4, -4), Eigen::Vector3d(4, 4, 4));

/// Ten nodes side by side that look along z at a box 8 wide: one has a place close to it in frame, all have
/// the far end.
class LittleSeen : public ::testing::Test {
 protected:
  LittleSeen() {
    for (int n = 0; n < 10; ++n) nodes_.push_back({view_at(1.0 * n - 4.5)});
    for (const LatticeFrame& frame : nested_frames(kBox, 0.25, 1)) {
      lattices_.emplace_back(frame);
      const Eigen::Vector3i size = frame.size_in_bricks;
      for (int b = 0; b < size.prod(); ++b)
        lattices_.back().insert_brick({b % size.x(), b / size.x() % size.y(), b / (size.x() * size.y())},
                                      ~BrickMask());
    }
    lattices_[1].erase_inside(lattices_[0].frame().box());
  }

  SampleView view_at(double x) const {
    const PinholeCamera camera = camera_at({x, 0, -8}, {x, 0, 0}, 16, 16, {0, 1, 0});
    return view_of(camera, plain_image(16, {50, 0, 0}), plan_of(kRange, 0));
  }
  static Eigen::Vector3i voxel_at(const Topology& lattice, const Eigen::Vector3d& x) {
    return ((x - lattice.frame().origin) / lattice.frame().voxel_size).array().floor().cast<int>();
  }
  int nodes_that_see(const Eigen::Vector3d& x) const {
    int count = 0;
    for (const SampleNode& node : nodes_)
      count += std::any_of(node.begin(), node.end(), [&](const SampleView& view) {
        const Eigen::Vector3d p = view.camera.project(x);
        return p.z() > kRange.begin && p.z() < kRange.end && p.x() >= 0 && p.x() < 16 && p.y() >= 0 &&
               p.y() < 16;
      });
    return count;
  }
  std::vector<Topology> dropped(double min_overlap, int threads = 1) const {
    std::vector<Topology> lattices = lattices_;
    const std::int64_t gone = drop_little_seen(nodes_, kBox, min_overlap, RunContext(threads), lattices);
    EXPECT_EQ(lattices_[0].voxel_count() - gone, lattices[0].voxel_count());
    return lattices;
  }
  template <class Visit>
  void for_each_voxel(int lattice, const Visit& visit) const {
    const Topology& topology = lattices_[lattice];
    topology.for_each_brick([&](const Eigen::Vector3i& brick, const BrickMask& mask) {
      for (int v = 0; v < kBrickVoxels; ++v)
        if (mask[v]) visit(Eigen::Vector3i(8 * brick + Eigen::Vector3i(v % 8, v / 8 % 8, v / 64)));
    });
  }
  /// Of the box's voxels.
  template <class Holds>
  int count_kept(const std::vector<Topology>& left, const Holds& holds) const {
    int count = 0;
    for_each_voxel(0, [&](const Eigen::Vector3i& ijk) {
      if (left[0].contains(ijk) && holds(lattices_[0].frame().voxel_centre(ijk))) ++count;
    });
    return count;
  }

  std::vector<SampleNode> nodes_;
  std::vector<Topology> lattices_;
};

TEST_F(LittleSeen, GoesWhereMoreNodesHaveWhatLiesBehind) {
  const Eigen::Vector3d near_place(0.125, 0.125, -3.875), far_place(0.125, 0.125, 3.875);
  ASSERT_EQ(nodes_that_see(near_place), 4);
  ASSERT_EQ(nodes_that_see(far_place), 10);
  const Eigen::Vector3i near_voxel = voxel_at(lattices_[0], near_place);
  EXPECT_TRUE(dropped(0.35)[0].contains(near_voxel));
  EXPECT_FALSE(dropped(0.45)[0].contains(near_voxel));
  EXPECT_TRUE(dropped(1)[0].contains(voxel_at(lattices_[0], far_place)));
}

TEST_F(LittleSeen, NeverGoesWhereEnoughNodesHaveIt) {
  const std::vector<Topology> left = dropped(0.5);
  for_each_voxel(0, [&](const Eigen::Vector3i& ijk) {
    if (nodes_that_see(lattices_[0].frame().voxel_centre(ijk)) >= 5) {
      EXPECT_TRUE(left[0].contains(ijk)) << ijk.transpose();
    }
  });
}

TEST_F(LittleSeen, StaysWhereNothingBehindIsSeenBetter) {
  // At the sides of the box few nodes have anything in frame, near or far: the share is of what is on the
  // rays.
  const Eigen::Vector3d side(3.875, 3.875, 1.125);
  ASSERT_LT(nodes_that_see(side), 8);
  EXPECT_TRUE(dropped(0.75)[0].contains(voxel_at(lattices_[0], side)));
}

TEST_F(LittleSeen, GoesBeforeTheBoxButNotBehindIt) {
  const std::vector<Topology> left = dropped(0.5);
  const Topology& around = lattices_[1];
  const Eigen::Vector3i before = voxel_at(around, {0.25, 0.25, -5.25}),
                        behind = voxel_at(around, {0.25, 0.25, 5.25});
  ASSERT_TRUE(around.contains(before) && around.contains(behind));
  EXPECT_FALSE(left[1].contains(before));
  EXPECT_TRUE(left[1].contains(behind));
}

// However many have what lies behind: so may a post before a wall that a camera passes.
TEST_F(LittleSeen, StaysWhereADozenNodesHaveIt) {
  nodes_.clear();
  for (int n = 0; n < 120; ++n) nodes_.push_back({view_at(0.2 * n - 11.9)});
  const Eigen::Vector3d near_place(0.125, 0.125, -3.875);
  ASSERT_GT(nodes_that_see(near_place), kEnoughNodes);
  ASSERT_LT(nodes_that_see(near_place), 25);
  const Eigen::Vector3i voxel = voxel_at(lattices_[0], near_place);
  EXPECT_TRUE(dropped(1)[0].contains(voxel));
  // But not where all there are have the other.
  nodes_.erase(nodes_.begin() + 85, nodes_.end());
  nodes_.erase(nodes_.begin(), nodes_.begin() + 35);
  EXPECT_FALSE(dropped(1)[0].contains(voxel));
}

TEST_F(LittleSeen, IsToBeInASmallerShareWhereNotAllHaveWhatLiesBehind) {
  const Eigen::Vector3d near_place(0.125, 0.125, -3.875);
  const Eigen::Vector3i voxel = voxel_at(lattices_[0], near_place);
  ASSERT_EQ(nodes_that_see(near_place), 4);  // and ten what lies behind
  EXPECT_FALSE(dropped(0.45)[0].contains(voxel));
  for (int n = 0; n < 8; ++n) nodes_.push_back({view_at(40 + 10.0 * n)});  // ten are not most any more
  EXPECT_TRUE(dropped(0.45)[0].contains(voxel));
  EXPECT_FALSE(dropped(0.75)[0].contains(voxel));
}

TEST_F(LittleSeen, StaysBehindTheBoxThoughOneNodeAloneHasItInFrame) {
  nodes_ = {nodes_[0], nodes_[9]};
  const Eigen::Vector3d beside(7.75, 0.25, 5.25);
  ASSERT_EQ(nodes_that_see(beside), 1);
  EXPECT_TRUE(dropped(0.5)[1].contains(voxel_at(lattices_[1], beside)));
}

TEST_F(LittleSeen, IsWhatOneNodeAloneHasInFrame) {
  nodes_ = {nodes_[1], nodes_[4], nodes_[7]};
  const std::vector<Topology> left = dropped(1e-9);
  const auto seen_by = [&](int count) {
    return [this, count](const Eigen::Vector3d& x) { return nodes_that_see(x) == count; };
  };
  EXPECT_GT(count_kept(lattices_, seen_by(1)), 0);
  EXPECT_EQ(count_kept(left, seen_by(1)), 0);
  EXPECT_EQ(count_kept(left, seen_by(2)), count_kept(lattices_, seen_by(2)));
}

TEST_F(LittleSeen, CountsTheViewsOfANodeOnce) {
  const Eigen::Vector3i voxel = voxel_at(lattices_[0], {0.125, 0.125, -3.875});
  ASSERT_FALSE(dropped(0.45)[0].contains(voxel));
  for (SampleNode& node : nodes_) node = {node[0], node[0], node[0]};
  EXPECT_FALSE(dropped(0.45)[0].contains(voxel));
  SampleNode all;
  for (int v = 0; v < 7; ++v) all.push_back(view_at(0.25 * v - 0.75));
  nodes_ = {all, {view_at(-1)}, {view_at(1)}};
  EXPECT_TRUE(dropped(0.45)[0].contains(voxel));  // 3 of 3 nodes have it
}

TEST_F(LittleSeen, OneNodeIsEnoughWhereNoTwoShareAPlace) {
  nodes_ = {nodes_[5]};
  const std::vector<Topology> left = dropped(0.5);
  EXPECT_GT(left[0].voxel_count(), 0);
  EXPECT_EQ(left[0].voxel_count(),
            count_kept(lattices_, [&](const Eigen::Vector3d& x) { return nodes_that_see(x) == 1; }));
}

TEST_F(LittleSeen, IsTheSameInTheBoxBesideACameraThatLooksAway) {
  nodes_ = {nodes_[1], nodes_[4], nodes_[7]};
  const std::vector<Topology> before = dropped(1e-9);
  const PinholeCamera away = camera_at({0, 0, -9}, {0, 0, -20}, 16, 16, {0, 1, 0});
  nodes_.push_back({view_of(away, plain_image(16, {50, 0, 0}), plan_of({0, 60}, 0))});
  const std::vector<Topology> after = dropped(1e-9);
  EXPECT_LT(after[0].voxel_count(), lattices_[0].voxel_count());
  for_each_voxel(0, [&](const Eigen::Vector3i& ijk) {
    EXPECT_EQ(after[0].contains(ijk), before[0].contains(ijk)) << ijk.transpose();
  });
}

TEST_F(LittleSeen, DoesNotDependOnThreads) {
  const std::vector<Topology> one = dropped(0.5, 1);
  for (const int threads : {2, 4}) {
    const std::vector<Topology> many = dropped(0.5, threads);
    for (int k = 0; k < 2; ++k)
      for_each_voxel(k, [&](const Eigen::Vector3i& ijk) {
        EXPECT_EQ(many[k].contains(ijk), one[k].contains(ijk)) << k << ": " << ijk.transpose();
      });
  }
}

TEST_F(LittleSeen, StopsWhenCancelled) {
  RunContext context(2);
  context.cancel();
  EXPECT_THROW(drop_little_seen(nodes_, kBox, 0.5, context, lattices_), Cancelled);
}

}  // namespace
}  // namespace roxel

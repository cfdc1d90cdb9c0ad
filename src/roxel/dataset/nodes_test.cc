#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <random>

#include "roxel/dataset/rig_fixture.h"

namespace roxel {
namespace {

using ::testing::ElementsAre;

Dataset at_places(const std::vector<Eigen::Vector3d>& places) {
  Dataset dataset;
  for (const Eigen::Vector3d& place : places) {
    View view;
    view.camera.pose.centre = place;
    dataset.views.push_back(view);
  }
  return dataset;
}

TEST(Nodes, ViewsOfOnePlaceShareANode) {
  Dataset dataset = at_places({{0, 0, 0}, {5, 0, 0}, {1e-7, 0, 0}, {5, 1e-7, 0}, {0, 5, 0}});
  assign_nodes(dataset);
  ASSERT_EQ(dataset.nodes.size(), 3u);
  EXPECT_THAT(dataset.nodes[0].view_idxs, ElementsAre(0, 2));
  EXPECT_THAT(dataset.nodes[1].view_idxs, ElementsAre(1, 3));
  EXPECT_THAT(dataset.nodes[2].view_idxs, ElementsAre(4));
  EXPECT_LT((dataset.nodes[1].centre - Eigen::Vector3d(5, 5e-8, 0)).norm(), 1e-12);
  EXPECT_EQ(dataset.views[3].node_idx, 1);
}

TEST(Nodes, ToleranceIsInWorldUnitsAndChainsJoin) {
  Dataset dataset = at_places({{0, 0, 0}, {0.9, 0, 0}, {1.8, 0, 0}, {3, 0, 0}});
  assign_nodes(dataset, 1.0);
  ASSERT_EQ(dataset.nodes.size(), 2u);
  EXPECT_THAT(dataset.nodes[0].view_idxs, ElementsAre(0, 1, 2));
  assign_nodes(dataset, 0.5);
  EXPECT_EQ(dataset.nodes.size(), 4u);
}

TEST(Nodes, GivenIdsComeFirstInOrder) {
  Dataset dataset = at_places({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
  dataset.views[0].node_id = 9;
  dataset.views[1].node_id = 4;
  dataset.views[3].node_id = 9;
  assign_nodes(dataset);
  ASSERT_EQ(dataset.nodes.size(), 3u);
  EXPECT_THAT(dataset.nodes[0].view_idxs, ElementsAre(1));
  EXPECT_THAT(dataset.nodes[1].view_idxs, ElementsAre(0, 3)) << "far apart, but given as one";
  EXPECT_THAT(dataset.nodes[2].view_idxs, ElementsAre(2));
}

std::vector<Eigen::Vector3d> orbit(int count) {
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * M_PI * i / count;
    places.emplace_back(std::cos(angle), std::sin(angle), 0.3);
  }
  return places;
}

std::size_t count_nodes(const std::vector<Eigen::Vector3d>& places) {
  Dataset dataset = at_places(places);
  assign_nodes(dataset);
  return dataset.nodes.size();
}

TEST(Nodes, OneFarCameraJoinsNoOthers) {
  for (const int count : {3, 12, 100}) {
    std::vector<Eigen::Vector3d> places = orbit(count);
    places.emplace_back(1e9, 0, 0);
    EXPECT_EQ(count_nodes(places), places.size()) << count;
  }
}

TEST(Nodes, AQuarterOfStrayCamerasJoinsNoOthers) {
  std::vector<Eigen::Vector3d> places = orbit(40);
  for (int i = 0; i < 9; ++i) places.emplace_back(1e7, 1e8 * i, 0);
  EXPECT_EQ(count_nodes(places), places.size());
}

TEST(Nodes, NeighboursOfLongOrbitsAndPathsStayApart) {
  EXPECT_EQ(count_nodes(orbit(3000)), 3000u);
  std::vector<Eigen::Vector3d> path;
  for (int i = 0; i < 3000; ++i) path.emplace_back(0.1 * i, 0, 0);
  EXPECT_EQ(count_nodes(path), 3000u);
}

/// Panoramas at the corners of a square, their centres known to 1e-4 of its side; one holds half of all
/// views.
TEST(Nodes, CentresOfAPanoramaJoinThoughTheyAreNoisy) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0, 1e-4);
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i < 60; ++i) {
    const int corner = std::max(0, i - 29) % 4;
    places.emplace_back(corner % 2 + noise(random), corner / 2 + noise(random), noise(random));
  }
  EXPECT_EQ(count_nodes(places), 4u);
}

TEST(Nodes, AllAtOnePlaceAreOneNode) {
  Dataset dataset = at_places({{1, 2, 3}, {1, 2, 3}});
  assign_nodes(dataset);
  EXPECT_EQ(dataset.nodes.size(), 1u);
}

/// Every pair within the tolerance shares a node, and every node is a chain of such pairs: checked against
/// the plain transitive closure.
RC_GTEST_PROP(Nodes, EqualTheTransitiveClosure, ()) {
  const int count = *rc::gen::inRange(1, 25);
  std::mt19937 random(static_cast<unsigned>(*rc::gen::inRange(0, 1 << 30)));
  std::uniform_real_distribution<double> coordinate(0, 4);
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i < count; ++i)
    places.emplace_back(coordinate(random), coordinate(random), coordinate(random));
  Dataset dataset = at_places(places);
  assign_nodes(dataset, 1.0);
  std::vector<std::vector<char>> linked(count, std::vector<char>(count));
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) linked[i][j] = (places[i] - places[j]).norm() <= 1.0;
  }
  for (int k = 0; k < count; ++k) {
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j < count; ++j) linked[i][j] |= linked[i][k] && linked[k][j];
    }
  }
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      RC_ASSERT((dataset.views[i].node_idx == dataset.views[j].node_idx) == static_cast<bool>(linked[i][j]));
    }
  }
}

}  // namespace
}  // namespace roxel

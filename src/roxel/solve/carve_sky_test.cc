#include "roxel/solve/carve_sky.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace roxel {
namespace {

constexpr int kPhotoSide = 100;  ///< pixels
constexpr float kTau = 1;        ///< of the full volume: more opaque than not

/// Masks of both views of one node.
const std::vector<std::uint8_t> kFirst = {1, 1, 0, 0}, kSecond = {0, 0, 1, 1};

/// Full lattice of 24^3 voxels of side 0.1 about the origin.
Volume full_volume() {
  Topology topology(
      nested_frames({Eigen::Vector3d(-1.2, -1.2, -1.2), Eigen::Vector3d(1.2, 1.2, 1.2)}, 0.1, 0)[0]);
  for (int z = 0; z < 24; ++z)
    for (int y = 0; y < 24; ++y)
      for (int x = 0; x < 24; ++x) topology.insert({x, y, z});
  std::vector<Topology> lattices;
  lattices.push_back(std::move(topology));
  Volume volume(std::move(lattices));
  volume.resize_channels();
  std::fill(volume.tau.begin(), volume.tau.end(), kTau);
  std::fill(volume.support.begin(), volume.support.end(), std::array<float, 2>{3, 6});
  return volume;
}

/// Two cameras each at two places 4 in front of the volume (along z), 50 degrees wide: views 0 and 1 are the
/// first node's, 2 and 3, 0.4 beside them, the second's.
Dataset four_cameras() {
  Dataset dataset;
  for (int v = 0; v < 4; ++v) {
    View view;
    view.name = std::to_string(v);
    view.camera.intrinsics = {kPhotoSide, kPhotoSide, 100, 100, 50, 50, 0};
    view.camera.pose.centre = {v < 2 ? 0.0 : 0.4, 0, -4};
    dataset.views.push_back(view);
  }
  dataset.nodes.resize(2);
  dataset.nodes[0].view_idxs = {0, 1};
  dataset.nodes[1].view_idxs = {2, 3};
  return dataset;
}

/// Above row `horizon` all is sky, but for a square of two pixels at (70, 10).
Photograph sky_above(int horizon) {
  Photograph photo;
  photo.rgb = Image(kPhotoSide, kPhotoSide, 3);
  photo.foreground = Mask(kPhotoSide, kPhotoSide);
  photo.sky = Mask(kPhotoSide, kPhotoSide, 0);
  for (int y = 0; y < horizon; ++y)
    for (int x = 0; x < kPhotoSide; ++x) photo.sky.at(x, y) = 252;
  for (const auto& [x, y] : {std::pair{70, 10}, {71, 10}, {70, 11}, {71, 11}}) photo.sky.at(x, y) = 55;
  return photo;
}

float tau_at(const Volume& volume, const Eigen::Vector3d& at) {
  const BrickIndex& index = volume.index(0);
  const LatticeFrame& frame = index.frame();
  return volume
      .tau[index.slot(((at - frame.origin) / frame.voxel_size).array().floor().cast<int>().matrix())];
}

/// The volume after photographs have carved it.
Volume carved(int horizon, const std::vector<std::uint8_t>& sky_masked, int threads = 1,
              UpdateRule rule = UpdateRule::kPosterior) {
  const Dataset dataset = four_cameras();
  Volume volume = full_volume();
  carve_sky(
      dataset, [&](const View&) { return sky_above(horizon); }, sky_masked, rule, RunContext(threads),
      volume);
  return volume;
}

TEST(CarveSky, EmptiesWhatAPhotographShowsAsSkyAlone) {
  const Volume volume = carved(50, kFirst);  // above the optical axis: y < 0
  EXPECT_EQ(tau_at(volume, {0.05, -0.75, 0.05}), 0);
  EXPECT_EQ(tau_at(volume, {0.05, -0.75, 1.05}), 0);  // behind it, too
  EXPECT_EQ(tau_at(volume, {0.05, 0.75, 0.05}), kTau);
  // On the horizon, and where a quarter of the footprint is something else: row 10 is y / z = -0.4, column 70
  // 0.2.
  EXPECT_EQ(tau_at(volume, {0.05, -0.05, 0.05}), 0);  // down to row 50
  EXPECT_EQ(tau_at(carved(49, kFirst), {0.05, -0.05, 0.05}), kTau);
  EXPECT_EQ(tau_at(volume, {0.65, -1.15, -1.05}), kTau);
  EXPECT_EQ(tau_at(volume, {0.05, -1.15, -1.05}), 0);
}

TEST(CarveSky, LeavesWhatTheSkyFillsToThreeQuarters) {
  const Dataset dataset = four_cameras();
  const Eigen::Vector3d at(0.05, -0.75, 0.05);  // rows 29 to 32
  for (const auto& [dark_rows, emptied] : {std::pair{0.2, true}, {0.7, false}}) {
    const PhotographLoader load = [&](const View&) {
      Photograph photo = sky_above(50);
      for (int x = 0; x < kPhotoSide; ++x)
        photo.sky.at(x, 30) = static_cast<std::uint8_t>(255 * (1 - dark_rows));
      return photo;
    };
    Volume volume = full_volume();
    carve_sky(dataset, load, kFirst, UpdateRule::kPosterior, RunContext(1), volume);
    EXPECT_EQ(tau_at(volume, at) == 0, emptied) << dark_rows;
  }
}

TEST(CarveSky, LeavesWhatHasItsCentreOutsideTheImage) {
  const Volume by_first = carved(kPhotoSide, kFirst), by_second = carved(kPhotoSide, kSecond);
  EXPECT_EQ(tau_at(by_first, {0.05, 0.05, -1.15}), 0);
  EXPECT_EQ(tau_at(by_first, {0.05, -1.15, -1.15}), 0);  // row 10
  // Column 50 + 100 x / z of the second camera: 50 - 145 / 2.85 is outside, and 50 - 140 / 2.9 inside.
  EXPECT_EQ(tau_at(by_second, {-1.05, 0.05, -1.15}), kTau);
  EXPECT_EQ(tau_at(by_second, {1.15, 0.05, -1.15}), 0);
  // 50 - 100 * 1.45 / 2.95 = 0.8, and its left corners are 1.5 / 2.9 off: the part that is seen says it.
  EXPECT_EQ(tau_at(by_second, {-1.05, 0.05, -1.05}), 0);
}

TEST(CarveSky, LeavesWhatTheLensDoesNotReach) {
  const auto load = [](const View&) {
    Photograph photo = sky_above(50);
    photo.valid = Mask(kPhotoSide, kPhotoSide);
    for (int x = 0; x < kPhotoSide; ++x) photo.valid.at(x, 20) = 0;
    return photo;
  };
  Volume volume = full_volume();
  carve_sky(four_cameras(), load, kFirst, UpdateRule::kPosterior, RunContext(1), volume);
  EXPECT_EQ(tau_at(volume, {0.05, -1.15, 0.05}), kTau);  // rows 20 to 24
  EXPECT_EQ(tau_at(volume, {0.05, -0.75, 0.05}), 0);
}

TEST(CarveSky, TakesTwoNodesWhereTwoKnowTheirSky) {
  const Eigen::Vector3d above(0.05, -0.75, 0.05);
  EXPECT_EQ(tau_at(carved(50, {0, 0, 0, 0}), above), kTau);
  EXPECT_EQ(tau_at(carved(50, {}), above), kTau);
  EXPECT_EQ(tau_at(carved(50, {1, 0, 0, 0}), above), kTau) << "one photograph";
  EXPECT_EQ(tau_at(carved(50, {0, 0, 1, 1}), above), 0) << "two of the only node";
  EXPECT_EQ(tau_at(carved(50, {1, 0, 1, 0}), above), 0) << "one of each node";
  // The second node's photographs show no sky: the first's two are one witness.
  Volume volume = full_volume();
  const PhotographLoader load = [](const View& view) { return sky_above(view.name < "2" ? 50 : 0); };
  carve_sky(four_cameras(), load, {1, 1, 1, 1}, UpdateRule::kPosterior, RunContext(1), volume);
  EXPECT_EQ(tau_at(volume, above), kTau);
}

TEST(CarveSky, OneIsEnoughForHaze) {
  const Eigen::Vector3d above(0.05, -0.75, 0.05);
  for (const auto& [opacity, emptied] : {std::pair{0.48f, true}, {0.52f, false}}) {
    Volume volume = full_volume();
    std::fill(volume.tau.begin(), volume.tau.end(), tau_from_alpha(opacity));
    carve_sky(
        four_cameras(), [](const View&) { return sky_above(50); }, {1, 0, 0, 0}, UpdateRule::kPosterior,
        RunContext(1), volume);
    EXPECT_EQ(tau_at(volume, above) == 0, emptied) << opacity;
  }
}

TEST(CarveSky, AsksMasksOfTheSkyAlone) {
  const auto load = [](const View&) {
    Photograph photo = sky_above(50);
    photo.foreground = Mask(kPhotoSide, kPhotoSide, 0);  // no object anywhere
    return photo;
  };
  Volume volume = full_volume();
  carve_sky(four_cameras(), load, kFirst, UpdateRule::kPosterior, RunContext(1), volume);
  EXPECT_EQ(volume.tau, carved(50, kFirst).tau);
}

TEST(CarveSky, CountsAndLeavesNoHits) {
  const Dataset dataset = four_cameras();
  Volume volume = full_volume();
  const PhotographLoader load = [](const View&) { return sky_above(50); };
  const std::int64_t count = carve_sky(dataset, load, kFirst, UpdateRule::kPosterior, RunContext(1), volume);
  EXPECT_EQ(count, std::count(volume.tau.begin(), volume.tau.end(), 0.0f));
  EXPECT_GT(count, 24 * 24 * 24 / 4);
  for (std::uint32_t slot = 0; slot < volume.slot_count(); ++slot)
    EXPECT_EQ(volume.support[slot],
              (volume.tau[slot] > 0 ? std::array<float, 2>{3, 6} : std::array<float, 2>{0, 6}));
  EXPECT_EQ(carve_sky(dataset, load, kFirst, UpdateRule::kPosterior, RunContext(1), volume), 0);
  const Volume roxels = carved(50, kFirst, 1, UpdateRule::kRoxels);
  for (std::uint32_t slot = 0; slot < roxels.slot_count(); ++slot) {
    if (roxels.tau[slot] > 0) continue;
    EXPECT_EQ(roxels.support[slot], (std::array<float, 2>{3, 0}));
  }
}

TEST(CarveSky, ThreadsDoNotMatter) {
  EXPECT_EQ(carved(50, {1, 1, 1, 1}, 1).tau, carved(50, {1, 1, 1, 1}, 4).tau);
}

}  // namespace
}  // namespace roxel

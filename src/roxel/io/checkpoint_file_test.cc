#include "roxel/io/checkpoint_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "roxel/base/error.h"
#include "roxel/base/full_disc_fixture.h"
#include "roxel/io/dataset_fixture.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

/// Two nested lattices with a few voxels each, and a number of its own in every channel of every slot.
Volume some_volume(float seed) {
  std::vector<Topology> lattices;
  for (const LatticeFrame& frame :
       nested_frames({Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1.3, 1)}, 0.03, 1)) {
    Topology topology(frame);
    for (int n = 0; n < 200; ++n) topology.insert({(n * 7) % 31, (n * 13) % 29, (n * 3) % 23});
    lattices.push_back(std::move(topology));
  }
  Volume volume(std::move(lattices));
  float next = seed;
  const auto fill = [&](float& value) { value = next += 0.37f; };
  for (std::uint32_t slot = 0; slot < volume.slot_count(); ++slot) {
    for (float* value : {&volume.tau[slot], &volume.confidence[slot], &volume.color_weight[slot]})
      fill(*value);
    for (float& value : volume.color_mean[slot]) fill(value);
    std::array<float, 6> cov;
    for (float& value : cov) fill(value);
    volume.color_cov[slot] = PackedCovariance(cov);
    for (float& value : volume.support[slot]) fill(value);
  }
  return volume;
}

Checkpoint some_checkpoint(int level, int passes) {
  Checkpoint made;
  made.state = {level, passes, 3, true, false, false, LightSource::kGain, 12.25};
  PassRecord pass;
  pass.level = level;
  pass.pass = passes;
  pass.mean_log_likelihood = -1.0 / 3;
  pass.steps = 1234567890123;
  made.summary.passes = {pass, pass};
  made.summary.levels.resize(1);
  made.summary.levels[0].voxel_size = 0.1;
  made.summary.light.resize(2);
  made.summary.stages = {{"survey", 0.5, 77}};
  made.summary.notes = {"a note \xff that is not UTF-8"};
  made.summary.seconds = 3.5;
  made.light = {{1, 1.1f, 0.9f}, {2, 2, 2}};
  made.accelerated = {{0.1f, 0.2f}, {0.3f, -0.4f}};
  made.volume = some_volume(static_cast<float>(passes));
  return made;
}

CheckpointView view_of(const Checkpoint& made) {
  return {made.state, made.summary, made.light, made.accelerated, made.volume};
}

const nlohmann::ordered_json kMadeFrom{{"dataset_hash", "abc"}, {"options", {{"levels", 3}, {"noise", 0.1}}}};

class CheckpointFile : public ::testing::Test {
 protected:
  void write(int level, int passes) {
    write_checkpoint(run_, kMadeFrom, view_of(some_checkpoint(level, passes)));
  }
  fs::path latest() const { return run_ / "checkpoint/latest.roxel"; }
  fs::path previous() const { return run_ / "checkpoint/previous.roxel"; }

  void damage(const fs::path& file, std::uintmax_t at) {
    std::fstream io(file, std::ios::in | std::ios::out | std::ios::binary);
    io.seekg(static_cast<std::streamoff>(at));
    const char byte = static_cast<char>(io.get());
    io.seekp(static_cast<std::streamoff>(at));
    io.put(static_cast<char>(byte ^ 0x10));
  }

  TempFolder folder_;
  fs::path run_ = folder_.path() / "run";
};

TEST_F(CheckpointFile, ComesBackBitForBit) {
  write(2, 5);
  const std::optional<FoundCheckpoint> found = read_checkpoint(run_, kMadeFrom);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->warning, "");
  const Checkpoint expected = some_checkpoint(2, 5);
  const Checkpoint& back = found->checkpoint;
  EXPECT_EQ(back.state.level, 2);
  EXPECT_EQ(back.state.passes, 5);
  EXPECT_EQ(back.state.draft_passes, 3);
  EXPECT_TRUE(back.state.resting);
  EXPECT_FALSE(back.state.light_rests);
  EXPECT_FALSE(back.state.level_done);
  EXPECT_EQ(back.state.light_from, LightSource::kGain);
  EXPECT_EQ(back.state.level_seconds, 12.25);
  ASSERT_EQ(back.summary.passes.size(), 2u);
  EXPECT_EQ(back.summary.passes[1].mean_log_likelihood, -1.0 / 3);
  EXPECT_EQ(back.summary.passes[1].steps, 1234567890123);
  EXPECT_EQ(back.summary.levels.at(0).voxel_size, 0.1);
  EXPECT_EQ(back.summary.light.size(), 2u);
  EXPECT_EQ(back.summary.stages.at(0).name, "survey");
  EXPECT_EQ(back.summary.seconds, 3.5);
  EXPECT_EQ(back.light, expected.light);
  ASSERT_EQ(back.accelerated.size(), 2u);
  EXPECT_EQ(back.accelerated[1].made, -0.4f);
  ASSERT_EQ(back.volume.lattice_count(), 2);
  for (int k = 0; k < 2; ++k) {
    const LatticeFrame &a = back.volume.index(k).frame(), &b = expected.volume.index(k).frame();
    EXPECT_EQ(a.origin, b.origin);
    EXPECT_EQ(a.voxel_size, b.voxel_size);
    EXPECT_EQ(a.size_in_bricks, b.size_in_bricks);
    for (const Brick& brick : expected.volume.index(k).bricks())
      for (int v = 0; v < kBrickVoxels; ++v) {
        const Eigen::Vector3i ijk = kBrickSide * brick.coord + Eigen::Vector3i(v % 8, v / 8 % 8, v / 64);
        ASSERT_EQ(back.volume.index(k).slot(ijk), expected.volume.index(k).slot(ijk));
      }
  }
  EXPECT_EQ(back.volume.tau, expected.volume.tau);
  EXPECT_EQ(back.volume.confidence, expected.volume.confidence);
  EXPECT_EQ(back.volume.color_weight, expected.volume.color_weight);
  EXPECT_EQ(back.volume.color_mean, expected.volume.color_mean);
  EXPECT_EQ(back.volume.color_cov, expected.volume.color_cov);
  EXPECT_EQ(back.volume.support, expected.volume.support);
}

TEST_F(CheckpointFile, NoneIsNoError) {
  EXPECT_FALSE(has_checkpoint(run_));
  EXPECT_FALSE(read_checkpoint(run_, kMadeFrom));
}

// One flipped bit anywhere, or a file cut anywhere: the one before is taken, and it is said why.
TEST_F(CheckpointFile, ADamagedOneFallsBackToTheOneBefore) {
  write(1, 1);
  write(1, 2);
  ASSERT_TRUE(fs::exists(previous()));
  const std::uintmax_t size = fs::file_size(latest());
  for (const std::uintmax_t at : {std::uintmax_t{0}, std::uintmax_t{19}, std::uintmax_t{25},
                                  std::uintmax_t{60}, size / 3, size / 2, size - 30, size - 1}) {
    damage(latest(), at);
    const std::optional<FoundCheckpoint> found = read_checkpoint(run_, kMadeFrom);
    ASSERT_TRUE(found) << at;
    EXPECT_EQ(found->checkpoint.state.passes, 1) << at;
    EXPECT_NE(found->warning.find("latest.roxel: found "), std::string::npos) << found->warning;
    damage(latest(), at);  // the same bit again: whole
  }
  EXPECT_EQ(read_checkpoint(run_, kMadeFrom)->checkpoint.state.passes, 2);
  for (const std::uintmax_t cut :
       {size - 1, size / 2, std::uintmax_t{40}, std::uintmax_t{5}, std::uintmax_t{0}}) {
    fs::resize_file(latest(), cut);
    EXPECT_EQ(read_checkpoint(run_, kMadeFrom)->checkpoint.state.passes, 1) << cut;
  }
}

TEST_F(CheckpointFile, WithBothDamagedItIsAnErrorThatNamesBoth) {
  write(1, 1);
  write(1, 2);
  damage(latest(), 100);
  fs::resize_file(previous(), 64);
  try {
    read_checkpoint(run_, kMadeFrom);
    FAIL();
  } catch (const InvalidInput& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("latest.roxel: found "), std::string::npos) << text;
    EXPECT_NE(text.find("previous.roxel: found "), std::string::npos) << text;
  }
}

TEST_F(CheckpointFile, OfAnotherRunNamesWhatDiffers) {
  write(1, 1);
  nlohmann::ordered_json other = kMadeFrom;
  other["options"]["levels"] = 4;
  try {
    read_checkpoint(run_, other);
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("options.levels 3 (now 4)"), std::string::npos) << error.what();
  }
}

TEST_F(CheckpointFile, AFullDiscLeavesTheOldOnes) {
  write(1, 1);
  write(1, 2);
  {
    const fixture::FileSizeLimit limit(4096);
    EXPECT_THROW(write(1, 3), IoError);
  }
  EXPECT_EQ(read_checkpoint(run_, kMadeFrom)->checkpoint.state.passes, 2);
  EXPECT_EQ(std::distance(fs::directory_iterator(run_ / "checkpoint"), {}), 2);
}

TEST_F(CheckpointFile, RemovingThemRemovesTheirFolder) {
  write(1, 1);
  write(1, 2);
  EXPECT_TRUE(has_checkpoint(run_));
  remove_checkpoints(run_);
  EXPECT_FALSE(fs::exists(run_ / "checkpoint"));
}

}  // namespace
}  // namespace roxel

#include "roxel/report/run_record.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/base/temp_folder.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

class RunRecordTest : public testing::Test {
 protected:
  void write_summary(const RunRecord& record) {
    write_text_atomically(folder_ / "summary.json", to_json(record).dump());
  }

  const TempFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

RunRecord small_record() {
  RunRecord record;
  record.command_line = "roxel reconstruct a -o b";
  record.options = {{"passes", 3}};
  record.scene.bounds.box = {Eigen::Vector3d(0, 1, 2), Eigen::Vector3d(3, 4, 5)};
  record.frame.size_in_bricks = {1, 2, 3};
  record.summary.passes.resize(2);
  record.views = {{"left/000", "00ff", 12.5, 40, 0.5}, {"right", "0", {}, 0, {}}};
  record.reprojection_rms = 12.5;
  return record;
}

TEST_F(RunRecordTest, HoldsWhatTheRunDid) {
  write_summary(small_record());
  const nlohmann::json summary = read_summary(folder_);
  EXPECT_EQ(summary["dataset"]["images"], 2);
  EXPECT_EQ(summary["scene"]["bounds"], (std::vector<double>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(summary["scene"]["lattice_voxels"], (std::vector<int>{8, 16, 24}));
  EXPECT_EQ(summary["passes"].size(), 2);
  EXPECT_EQ(summary["views"][0]["reprojection_rms_percent"], 12.5);
  EXPECT_TRUE(summary["views"][1]["reprojection_rms_percent"].is_null());
  EXPECT_TRUE(summary["views"][1]["depth_share"].is_null());
  const FinishedRun run{folder_, summary, {Volume(), {ColorTransform()}}};
  EXPECT_EQ(run.option("passes"), 3);
  EXPECT_TRUE(run.option("levels").is_null());
}

TEST_F(RunRecordTest, AKnownBackgroundIsWrittenAsLinearRgb) {
  RunRecord record = small_record();
  record.scene.background.kind = BackgroundKind::kKnown;
  const float rgb[3] = {0.2f, 0.4f, 0.1f};
  record.scene.transform.from_rgb(rgb, record.scene.background.mean);
  const auto color = to_json(record)["scene"]["background"]["color"];
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(color[c].get<double>(), rgb[c], 1e-5);
}

TEST_F(RunRecordTest, AFolderThatIsNoRunIsInvalid) {
  const auto message = [&] {
    try {
      read_summary(folder_);
    } catch (const InvalidInput& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(message().find("no readable summary.json"), std::string::npos);
  for (const char* text : {"", "{", "[]", "{}", "{\"format\": 2}", "{\"format\": \"1\"}"}) {
    write_text_atomically(folder_ / "summary.json", std::string(text) + "\n");
    EXPECT_NE(message().find("summary.json"), std::string::npos) << text;
  }
}

TEST_F(RunRecordTest, OnlyListedFilesOfAnEarlierRunAreRemoved) {
  write_summary(small_record());
  const std::vector<fs::path> ours = {folder_ / "volume.vdb", view_path(folder_, "depth", "left/000", ".exr"),
                                      view_path(folder_, "error", "right", ".png")};
  const std::vector<fs::path> others = {folder_ / "notes.txt",
                                        view_path(folder_, "depth", "left/001", ".exr")};
  for (const auto& list : {ours, others})
    for (const fs::path& file : list) write_text_atomically(file, "x");
  remove_results(folder_);
  for (const fs::path& file : ours) EXPECT_FALSE(fs::exists(file)) << file;
  for (const fs::path& file : others) EXPECT_TRUE(fs::exists(file)) << file;
  EXPECT_FALSE(fs::exists(folder_ / "summary.json"));
  write_text_atomically(folder_ / "volume.vdb", "x");
  remove_results(folder_);  // no summary: whose files these are is not known
  EXPECT_TRUE(fs::exists(folder_ / "volume.vdb"));
}

TEST_F(RunRecordTest, ViewPathsStayInsideTheRun) {
  EXPECT_EQ(view_path("run", "depth", "a/b.001", ".exr"), fs::path("run/depth/a/b.001.exr"));
  EXPECT_EQ(view_path("run", "depth", "/../../etc/x", ".png"), fs::path("run/depth/etc/x.png"));
}

TEST(DatasetHash, ChangesWithFileAndCamera) {
  View view;
  view.name = "a";
  const auto hash = [](const View& v, const std::string& file) {
    std::string combined;
    add_to_hash(v, file, combined);
    return combined;
  };
  View moved = view;
  moved.camera.pose.centre.x() += 1e-12;
  EXPECT_EQ(hash(view, "1"), hash(view, "1"));
  EXPECT_NE(hash(view, "1"), hash(view, "2"));
  EXPECT_NE(hash(view, "1"), hash(moved, "1"));
}

}  // namespace
}  // namespace roxel

#include "roxel/base/atomic_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <thread>
#include <vector>

#include "roxel/base/error.h"
#include "roxel/base/full_disc_fixture.h"
#include "roxel/base/temp_folder.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class AtomicFile : public testing::Test {
 protected:
  /// Names of all files in the folder: what is left over would show here.
  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& entry : fs::directory_iterator(folder_)) all.push_back(entry.path().filename());
    return all;
  }

  const TempFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(AtomicFile, WritesAndReplaces) {
  write_text_atomically(folder_ / "a.txt", "first, and longer");
  write_text_atomically(folder_ / "a.txt", std::string_view("se\0cond", 7));
  EXPECT_EQ(content(folder_ / "a.txt"), std::string("se\0cond", 7));
  EXPECT_EQ(names(), std::vector<std::string>{"a.txt"});
}

TEST_F(AtomicFile, MakesFolders) {
  write_text_atomically(folder_ / "b/c/d.txt", "x");
  EXPECT_EQ(content(folder_ / "b/c/d.txt"), "x");
}

TEST_F(AtomicFile, KeepsTheSuffixAndTheFolderOfTheTarget) {
  fs::path seen;
  write_file_atomically(folder_ / "depth.00.exr", [&](const fs::path& temporary) {
    seen = temporary;
    EXPECT_FALSE(fs::exists(folder_ / "depth.00.exr"));
    std::ofstream(temporary) << "x";
  });
  EXPECT_EQ(seen.extension(), ".exr");
  EXPECT_EQ(seen.parent_path(), folder_);
  EXPECT_NE(seen, folder_ / "depth.00.exr");
}

TEST_F(AtomicFile, LeavesTheOldFileWhenTheWriterThrows) {
  write_text_atomically(folder_ / "a.txt", "old");
  const auto fail = [](const fs::path& temporary) {
    std::ofstream(temporary) << "half";
    throw NumericalError("no");
  };
  EXPECT_THROW(write_file_atomically(folder_ / "a.txt", fail), NumericalError);
  EXPECT_EQ(content(folder_ / "a.txt"), "old");
  EXPECT_EQ(names(), std::vector<std::string>{"a.txt"});
}

TEST_F(AtomicFile, ReportsAWriterThatWroteNothing) {
  EXPECT_THROW(write_file_atomically(folder_ / "a.txt", [](const fs::path&) {}), IoError);
  EXPECT_TRUE(names().empty());
}

TEST_F(AtomicFile, ReportsATargetThatCannotBe) {
  fs::create_directories(folder_ / "taken/inside");
  EXPECT_THROW(write_text_atomically(folder_ / "taken", "x"), IoError);
  EXPECT_EQ(names(), std::vector<std::string>{"taken"});
  write_text_atomically(folder_ / "file", "x");
  EXPECT_THROW(write_text_atomically(folder_ / "file/below", "x"), IoError);
  EXPECT_THROW(write_text_atomically("/proc/roxel/x", "x"), IoError);
}

TEST_F(AtomicFile, LeavesTheOldFileWhenTheDiscIsFull) {
  write_text_atomically(folder_ / "a.txt", "old");
  {
    const fixture::FileSizeLimit limit(1000);
    EXPECT_THROW(write_text_atomically(folder_ / "a.txt", std::string(100000, 'x')), IoError);
  }
  EXPECT_EQ(content(folder_ / "a.txt"), "old");
  EXPECT_EQ(names(), std::vector<std::string>{"a.txt"});
}

TEST_F(AtomicFile, WritersOfOneTargetDoNotMix) {
  const auto write_often = [&](char letter) {
    for (int i = 0; i < 50; ++i) write_text_atomically(folder_ / "a.txt", std::string(5000, letter));
  };
  std::thread other(write_often, 'b');
  write_often('a');
  other.join();
  const std::string last = content(folder_ / "a.txt");
  EXPECT_TRUE(last == std::string(5000, 'a') || last == std::string(5000, 'b'));
  EXPECT_EQ(names(), std::vector<std::string>{"a.txt"});
}

}  // namespace
}  // namespace roxel

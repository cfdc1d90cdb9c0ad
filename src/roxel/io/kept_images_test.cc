#include "roxel/io/kept_images.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "roxel/base/error.h"
#include "roxel/base/temp_folder.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

class KeptImages : public ::testing::Test {
 protected:
  TempFolder folder_;
  fs::path path_ = folder_.path() / "some" / "where";
};

TEST_F(KeptImages, ComeBackBitForBit) {
  Image noise(7, 5, 3), depth(2, 9, 1);
  for (std::size_t i = 0; i < noise.data().size(); ++i) noise.data()[i] = 1.0f / static_cast<float>(i + 3);
  for (std::size_t i = 0; i < depth.data().size(); ++i) depth.data()[i] = -1e30f * static_cast<float>(i);
  const Image none;
  write_kept_images(path_, {&noise, &none, &depth});
  const std::vector<Image> back = read_kept_images(path_);
  ASSERT_EQ(back.size(), 3u);
  EXPECT_EQ(back[0].data(), noise.data());
  EXPECT_EQ(back[0].width(), 7);
  EXPECT_EQ(back[0].channels(), 3);
  EXPECT_TRUE(back[1].empty());
  EXPECT_EQ(back[2].data(), depth.data());
  EXPECT_EQ(back[2].height(), 9);
}

TEST_F(KeptImages, AreErrorsWhenMissingCutOffOrOther) {
  EXPECT_THROW(read_kept_images(path_), IoError);
  const Image image(40, 30, 1);
  write_kept_images(path_, {&image});
  const auto whole = fs::file_size(path_);
  for (const auto size : {whole - 1, whole / 2, std::uintmax_t{11}, std::uintmax_t{0}}) {
    fs::resize_file(path_, size);
    EXPECT_THROW(read_kept_images(path_), IoError) << size;
  }
  std::ofstream(path_) << "something else altogether, and long enough";
  EXPECT_THROW(read_kept_images(path_), IoError);
}

}  // namespace
}  // namespace roxel

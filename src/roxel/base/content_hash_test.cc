#include "roxel/base/content_hash.h"

#include <gtest/gtest.h>

#include <rapidcheck/gtest.h>
#include <fstream>

#include "roxel/base/error.h"
#include "roxel/base/temp_folder.h"

namespace roxel {
namespace {

// Test vectors of the FNV authors.
TEST(ContentHash, MatchesPublishedValues) {
  EXPECT_EQ(ContentHash().hex(), "cbf29ce484222325");
  EXPECT_EQ(ContentHash().update("a").hex(), "af63dc4c8601ec8c");
  EXPECT_EQ(ContentHash().update("foobar").hex(), "85944171f73967e8");
}

RC_GTEST_PROP(ContentHash, DoesNotDependOnHowBytesAreCut,
              (const std::string& head, const std::string& tail)) {
  RC_ASSERT(ContentHash().update(head).update(tail).value() == ContentHash().update(head + tail).value());
}

RC_GTEST_PROP(ContentHash, SeesOneChangedByte, (std::string text, char other)) {
  RC_PRE(!text.empty());
  const std::size_t place = *rc::gen::inRange<std::size_t>(0, text.size());
  RC_PRE(text[place] != other);
  const auto before = ContentHash().update(text).value();
  text[place] = other;
  RC_ASSERT(ContentHash().update(text).value() != before);
}

TEST(HashFile, HashesTheContentOfLongFiles) {
  const TempFolder folder;
  const auto file = folder / "long";
  std::string content;
  for (int i = 0; i < 200000; ++i) content += static_cast<char>(i * 31 / 7);
  std::ofstream(file, std::ios::binary) << content;
  EXPECT_EQ(hash_file(file), ContentHash().update(content).hex());
}

TEST(HashFile, ReportsWhatCannotBeRead) {
  EXPECT_THROW(hash_file("/nonexistent/file"), IoError);
  EXPECT_THROW(hash_file(TempFolder().path()), IoError);
}

}  // namespace
}  // namespace roxel

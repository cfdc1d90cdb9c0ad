// docs/options.md is made from the options table. After a change of options: make docs
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "roxel/base/atomic_file.h"
#include "roxel/solve/options.h"

namespace roxel {
namespace {

const char* const kIntroduction =
    "# Options of `reconstruct`\n"
    "\n"
    "Made from the options table (`roxel/solve/options.cc`) by `make docs`. In a JSON file (`--config "
    "FILE.json`) the\n"
    "keys are the names without dashes; a switch such as `--no-adaptive` is `\"adaptive\": false`. Unknown "
    "keys are\n"
    "errors. Options of input, depth, mesh and of the run itself are on [commands.md](commands.md#options).\n"
    "\n";

TEST(Docs, OptionsPageIsUpToDate) {
  const std::string page = kIntroduction + reconstruct_option_table().markdown();
  const std::string file = ROXEL_SOURCE_DIR "/docs/options.md";
  if (std::getenv("ROXEL_UPDATE_DOCS")) write_text_atomically(file, page);
  std::ifstream in(file, std::ios::binary);
  const std::string found{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(found, page) << "run: make docs";
}

}  // namespace
}  // namespace roxel

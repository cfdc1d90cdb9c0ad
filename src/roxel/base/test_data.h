#pragma once
/// For tests only: real data sets that lie beside the project and are not part of it. Tests that want one
/// skip, loudly, where it is missing.

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

namespace roxel {

/// The folder of data sets: the environment variable ROXEL_TEST_DATA, or else the first `shared/data` in
/// the source directory or a folder above it.
inline std::optional<std::filesystem::path> test_data_root() {
  namespace fs = std::filesystem;
  if (const char* chosen = std::getenv("ROXEL_TEST_DATA"); chosen && *chosen) {
    if (fs::is_directory(chosen)) return fs::path(chosen);
    return std::nullopt;
  }
  for (fs::path folder = ROXEL_SOURCE_DIR;; folder = folder.parent_path()) {
    if (fs::is_directory(folder / "shared/data")) return folder / "shared/data";
    if (folder == folder.parent_path()) return std::nullopt;
  }
}

/// One data set, such as "plane", or a file in it, such as "plane/mesh.ply".
inline std::optional<std::filesystem::path> test_data(const std::string& name) {
  const auto root = test_data_root();
  if (root && std::filesystem::exists(*root / name)) return *root / name;
  return std::nullopt;
}

}  // namespace roxel

/// Declares `variable`, the path of a data set, or skips the test. Include gtest first.
#define ROXEL_TEST_DATA_OR_SKIP(variable, name)                                                      \
  const auto variable##_found = ::roxel::test_data(name);                                            \
  if (!variable##_found)                                                                             \
    GTEST_SKIP() << "test data \"" << (name) << "\" is not here; set ROXEL_TEST_DATA to its folder"; \
  const std::filesystem::path variable = *variable##_found

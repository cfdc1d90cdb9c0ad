#pragma once
/// Content hashes that tell whether a file is still the one a run was made from. 64-bit FNV-1a [FNV]: it
/// finds changes and mix-ups, it is no protection against someone who forges a file.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace roxel {

/// Hashes bytes as they come; the same for any division of the bytes into calls.
class ContentHash {
 public:
  ContentHash& update(std::string_view bytes);
  std::uint64_t value() const { return value_; }
  /// 16 lower-case hexadecimal digits.
  std::string hex() const;

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

/// The hash of a file's content, as hex. Throws IoError where the file cannot be read.
std::string hash_file(const std::filesystem::path& file);

}  // namespace roxel

#include "roxel/base/content_hash.h"

#include <fstream>
#include <vector>

#include "roxel/base/error.h"

namespace roxel {

ContentHash& ContentHash::update(std::string_view bytes) {
  constexpr std::uint64_t kPrime = 0x100000001b3u;
  for (const unsigned char byte : bytes) value_ = (value_ ^ byte) * kPrime;
  return *this;
}

std::string ContentHash::hex() const {
  std::string digits(16, '0');
  for (int i = 0; i < 16; ++i) digits[i] = "0123456789abcdef"[(value_ >> (60 - 4 * i)) & 15];
  return digits;
}

std::string hash_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw IoError(file.string() + ": cannot be read");
  ContentHash hash;
  std::vector<char> block(1 << 16);
  // A short read ends the file; a folder or a failing disc sets bad().
  while (in.read(block.data(), static_cast<std::streamsize>(block.size())), in.gcount() > 0)
    hash.update({block.data(), static_cast<std::size_t>(in.gcount())});
  if (in.bad()) throw IoError(file.string() + ": reading failed");
  return hash.hex();
}

}  // namespace roxel

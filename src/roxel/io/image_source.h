#pragma once
/// Internal to image_file.cc: a whole image file in memory as floats, with what its header says about them.

#include <string>
#include <vector>

namespace roxel::internal {

/// How a file stores a channel's values, which tells how light follows from them.
enum class SampleKind { kByte, kShort, kOther, kFloat };

struct ImageSource {
  std::string path;
  int width = 0;
  int height = 0;
  std::vector<std::string> channel_names;
  int alpha_channel = -1;         ///< -1 where there is none
  bool alpha_multiplied = false;  ///< colours are stored times alpha
  SampleKind kind = SampleKind::kByte;
  std::vector<float> values;  ///< row-major, interleaved; integers are scaled to 0 ... 1

  int channels() const { return static_cast<int>(channel_names.size()); }
  std::size_t pixels() const { return static_cast<std::size_t>(width) * height; }
};

/// Throws InvalidInput unless the whole file can be decoded.
ImageSource read_image_source(const std::string& path);

/// A PNG's chunks, checked here because libpng writes to stderr when it meets a bad one: what is wrong with
/// the file's chunks, or nothing. Files of other formats pass.
std::string png_damage(const std::string& path);

}  // namespace roxel::internal

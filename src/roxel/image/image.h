#pragma once
/// Pixels in memory: row-major, interleaved, row 0 on top; pixel (x, y) covers [x, x+1) x [y, y+1).

#include <cstddef>
#include <cstdint>
#include <vector>

namespace roxel {

/// width x height x channels floats. Photographs are linear RGB (Rec. 709 primaries), 1 = display white for
/// 8- and 16-bit files, unbounded radiance for float files.
class Image {
 public:
  Image() = default;
  Image(int width, int height, int channels, float value = 0.0f)
      : width_(width),
        height_(height),
        channels_(channels),
        data_(static_cast<std::size_t>(width) * height * channels, value) {}

  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return channels_; }
  bool empty() const { return data_.empty(); }
  float* pixel(int x, int y) { return data_.data() + index(x, y); }
  const float* pixel(int x, int y) const { return data_.data() + index(x, y); }
  std::vector<float>& data() { return data_; }
  const std::vector<float>& data() const { return data_; }

 private:
  std::size_t index(int x, int y) const { return (static_cast<std::size_t>(y) * width_ + x) * channels_; }
  int width_ = 0;
  int height_ = 0;
  int channels_ = 0;
  std::vector<float> data_;
};

/// width x height bytes, 0 (no) to 255 (yes); values between are partly covered pixels.
class Mask {
 public:
  Mask() = default;
  Mask(int width, int height, std::uint8_t value = 255)
      : width_(width), height_(height), data_(static_cast<std::size_t>(width) * height, value) {}

  int width() const { return width_; }
  int height() const { return height_; }
  bool empty() const { return data_.empty(); }
  std::uint8_t& at(int x, int y) { return data_[static_cast<std::size_t>(y) * width_ + x]; }
  std::uint8_t at(int x, int y) const { return data_[static_cast<std::size_t>(y) * width_ + x]; }
  std::vector<std::uint8_t>& data() { return data_; }
  const std::vector<std::uint8_t>& data() const { return data_; }

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<std::uint8_t> data_;
};

}  // namespace roxel

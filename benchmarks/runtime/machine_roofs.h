#pragma once
/// What one core of this machine can do, measured beside what is to be judged by it.

#include <cstdint>
#include <memory>

namespace roxel {

/// 64-byte lines of memory: an array as large as a pass's scratch.
class Lines {
 public:
  explicit Lines(std::int64_t count);
  std::int64_t count() const { return count_; }

  /// Reads every line in order and writes it back: 128 bytes a line.
  void stream();
  /// The same with `lines` lines taken by chance, none waiting for the one before.
  void gather(std::int64_t lines);

 private:
  struct alignas(64) Line {
    float value[16];
  };
  std::int64_t count_;
  std::unique_ptr<Line[]> lines_;
};

/// Work that needs nothing but registers, so that two threads on two whole cores do twice as much: seconds
/// that each of `threads` threads needs for one and the same amount, all at once.
double register_loop_seconds(int threads);

}  // namespace roxel

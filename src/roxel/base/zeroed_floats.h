#pragma once
/// A large array of zeros that costs little to make: the system hands out zeroed pages, large ones where it
/// has them, so that making it touches nothing and using it faults seldom.

#include <cstddef>
#include <memory>

namespace roxel {

class ZeroedFloats {
 public:
  static constexpr int kLine = 16;  ///< numbers in a line of the cache

  /// Throws std::bad_alloc.
  explicit ZeroedFloats(std::size_t count);
  /// Begins a line of the cache.
  float* data() const { return first_; }

 private:
  struct Free {
    void operator()(void* memory) const;
  };
  std::unique_ptr<void, Free> memory_;
  float* first_ = nullptr;
};

}  // namespace roxel

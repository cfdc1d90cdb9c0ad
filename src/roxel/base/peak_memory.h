#pragma once
/// The most memory that a stretch of a program has held. The system keeps one high-water mark a process; each
/// stretch that begins lets it start anew, after it was added to those that are running, and gives back to
/// the system what was freed before it.

#include <cstdint>

namespace roxel {

/// From its construction on. Stretches may lie within one another, and run side by side.
class PeakMemory {
 public:
  PeakMemory();
  ~PeakMemory();
  PeakMemory(const PeakMemory&) = delete;
  PeakMemory& operator=(const PeakMemory&) = delete;

  /// Largest resident memory of the process since then. 0: not known, because the system's mark cannot start
  /// anew (Linux lets it, where /proc/self/clear_refs may be written).
  std::int64_t bytes() const;
  /// Begins again.
  void restart();

 private:
  friend class MemoryMarks;
  bool known_ = false;
  std::int64_t most_ = 0;
};

/// Largest resident memory of this process since it began, in bytes.
std::int64_t peak_memory_bytes();

}  // namespace roxel
